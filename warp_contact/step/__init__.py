"""One time step: what is captured. Nothing here reads back or allocates."""
