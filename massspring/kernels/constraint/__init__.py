"""Pressures that keep volumes."""
