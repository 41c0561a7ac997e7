"""Random trials that try to break every method."""
