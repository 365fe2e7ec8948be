"""Which vertices and edges may come to touch which bodies, for some steps."""
