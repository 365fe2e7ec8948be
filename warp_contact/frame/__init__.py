"""Frames: the number of steps, repeats, sleeping bodies. Reads back between steps."""
