"""Triangles: made, moved onto a level function, edited, repaired, compared."""
