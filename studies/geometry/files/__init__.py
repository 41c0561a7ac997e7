"""Reads and writes mesh files. Adding a format: studies.geometry.files.opening says where."""
