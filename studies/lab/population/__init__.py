"""Organs nobody has seen: members of a population drawn at random within anatomical ranges, each a scene of its own."""
