"""How near to the true shape of its organ a body must be to be recommended, or to be run without a warning."""

SHAPE, SHAPE_VOLUME = 1.0, 0.5
"""Bounds of shape_error and |shape_volume| [%]. A body beyond one of them is never recommended, whatever the wish."""
HELD_AREA, REFUSED_AREA = 3.0, 10.0
"""Of the area of a held region, against that of the region on the true surface [%]: a warning, and a refusal."""
FACETS = 20
"""Facets that touch a probe; with fewer its force may point in a wrong direction, which turns an organ about where it
is held (docs/accuracy.md)."""
