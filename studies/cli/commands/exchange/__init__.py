"""Scenes for other programs, and what these hand in."""
