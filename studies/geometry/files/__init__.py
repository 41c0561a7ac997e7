"""Reads and writes mesh files."""
