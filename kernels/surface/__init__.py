"""The contact surface: eq. (1), the search for equal pressures, the closure."""
