"""A surface from a file as a level function."""
