"""One equation per function."""
