"""Which recipe is good enough for a scene, read off the campaign of accuracy; never more than was measured."""
