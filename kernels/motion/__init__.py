"""Time stepping of vertices, the modes that limit the step, and who sleeps."""
