"""Time stepping of the vertices, the modes that limit the step, and sleeping bodies."""
