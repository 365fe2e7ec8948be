"""Broad phase: which vertices and edges may touch which bodies during the next steps."""
