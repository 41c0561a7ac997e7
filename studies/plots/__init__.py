"""One chart per file; matplotlib lives here only."""
