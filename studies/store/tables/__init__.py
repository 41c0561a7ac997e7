"""Tables of what is stored, for people and other programs."""
