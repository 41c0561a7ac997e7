"""One chart per file, one style; matplotlib lives here only."""
