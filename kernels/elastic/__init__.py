"""Elastic and damping forces of tets, one file for each material model."""
