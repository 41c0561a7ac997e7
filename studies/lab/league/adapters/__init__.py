"""Adapters for other programs, one file each: they read an exported scene and write results."""
