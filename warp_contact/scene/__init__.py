"""What is simulated: meshes, materials, bodies, and the model that they make. Knows no steps."""
