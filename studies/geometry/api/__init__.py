"""Meshes by name: organs, balls, and files of users."""
