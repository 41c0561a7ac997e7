"""How near to the true shape of its organ a body must be to be recommended, or to be run without a warning."""

SHAPE, SHAPE_VOLUME = 1.0, 0.5
"""Bounds of shape_error and |shape_volume| [%]. A body beyond one of them is never recommended, whatever the wish."""
HELD_AREA = 3.0
"""Of the area of a held region, against that of the region on the true surface [%]."""
