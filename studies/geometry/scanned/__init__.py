"""The surface of a file as a level function."""
