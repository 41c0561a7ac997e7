"""Reads and writes mesh files. Adding a format: studies.geometry.files.formats says where."""
