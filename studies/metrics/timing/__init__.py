"""Reliable measurement of frame times."""
