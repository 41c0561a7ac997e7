"""Thin tools against triangles (docs/theory.md, eq. 141 to 147)."""
