"""Frames: how many steps each takes, what is repeated, who sleeps. Reads back between steps."""
