"""Arguments of the compiled frame loops, as named tuples of arrays."""
