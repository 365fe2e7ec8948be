"""Narrow phase: the contacts of a step, each with depth, direction, triangle and weights."""
