"""The promised speeds over commits, for asv: `make speeds`."""
