"""Bodies that take implicit steps: how they answer impulses, and their part of a step."""
