"""Compares two results folders: changes between two versions, machines or users."""
