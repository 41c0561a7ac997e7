"""Thin tools against triangles (docs/theory.md, eq. 11.1 to 11.7)."""
