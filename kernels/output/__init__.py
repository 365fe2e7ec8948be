"""What is measured and drawn, outside of the step."""
