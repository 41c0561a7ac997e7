"""Contact modes: the directions that obstacles remove from the motion of a node (`Contacts.mode`)."""

FREE, SLIDES, ON_EDGE, STICKS, HIDDEN = range(5)
"""FREE: none. SLIDES: one, the normal of one obstacle. ON_EDGE: two, the node slides along the edge in which two
obstacles meet. STICKS: all three. HIDDEN: none, and the search for contacts leaves the node out."""
