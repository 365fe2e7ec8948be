"""USD stages: written frame by frame, read and checked."""
