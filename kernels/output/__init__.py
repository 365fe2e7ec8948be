"""Measurements and pictures, outside of the step."""
