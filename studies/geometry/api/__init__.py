"""Meshes by name: organs, balls, and the files of users."""
