"""Runs what is missing or stale, and reads what is stored."""
