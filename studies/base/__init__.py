"""Errors and tools without opinions."""
