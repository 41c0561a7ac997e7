"""The promised numbers, measured: `make bench`."""
