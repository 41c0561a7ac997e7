"""Mesh files, read and written; meshio is called here only."""
