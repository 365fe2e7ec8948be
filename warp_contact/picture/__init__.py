"""Pictures of a USD stage."""
