"""Particles, springs and kept volumes."""
