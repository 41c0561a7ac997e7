"""Small bodies for the tests: those of the oracles."""

from reference_fem.oracles.bodies import ball_octant, block, on_radius, shell_octant, symmetry, whole_ball

__all__ = ["ball_octant", "block", "on_radius", "shell_octant", "symmetry", "whole_ball"]
