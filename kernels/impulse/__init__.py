"""Impulses and friction between bodies, and the forces of other responses."""
