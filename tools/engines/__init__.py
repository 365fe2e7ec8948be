"""Whatever simulates a task: this package (``ours.py``), engines outside, and their settings."""
