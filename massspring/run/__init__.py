"""A run, frame by frame: set-up, checks, histories."""
