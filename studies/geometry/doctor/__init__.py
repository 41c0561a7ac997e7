"""Faults of a mesh, and the option that fixes each."""
