"""The promised speeds over commits, for asv: `make bench-commits`."""
