"""Figures of a state: energies, momenta, overlaps, contact forces. Only reads."""
