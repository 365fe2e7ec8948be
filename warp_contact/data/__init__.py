"""The arrays of a simulation: what stays, evolves or is shared by stages, which import them."""
