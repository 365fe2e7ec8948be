"""The arrays of a simulation: the constant ones, the state, and those that stages share."""
