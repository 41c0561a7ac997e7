"""Speeds over commits, measured by asv: `make speeds`. Set-ups use public names, so that they run on older code too."""
