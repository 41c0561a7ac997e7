"""Makes the frozen set of the league."""
