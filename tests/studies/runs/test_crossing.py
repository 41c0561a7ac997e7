"""How much of a surface lies inside the body itself, against bars wound onto themselves."""

import numpy as np
import pytest

from massspring.body.quadratic import boundary_facets, parts_of_facets
from studies.runs.crossing import crossed
from tests.massspring.quadratic import bricks

LENGTH, SIDE = 0.24, 0.02
BAR, CELLS = bricks((24, 2, 2), (LENGTH, SIDE, SIDE))
TRIANGLES = parts_of_facets(boundary_facets(CELLS))


def wound(turns, rise=0.5):
    """The bar in a helix of so many turns, each `rise` sides above the one before, and a quarter farther out."""
    radius = LENGTH / (2.0 * np.pi * turns)
    angle = BAR[:, 0] / radius
    out = radius + SIDE * (0.5 + angle / (8.0 * np.pi)) - BAR[:, 1]
    return np.column_stack([out * np.cos(angle), out * np.sin(angle), BAR[:, 2] + rise * SIDE * angle / (2.0 * np.pi)])


@pytest.mark.parametrize("turns", [1.1, 1.25, 1.5])
def test_of_a_bar_wound_onto_itself_what_is_inside_counts(turns):
    """As long as the overlap: three quarters of the side that faces the next turn, and of that which faces the one
    before, half of those that face outwards and inwards; and of each end three eighths."""
    overlap = LENGTH * (1.0 - 1.0 / turns)
    share = (2.5 * overlap * SIDE + 0.75 * SIDE**2) / (4.0 * LENGTH * SIDE + 2.0 * SIDE**2)
    assert crossed(TRIANGLES, BAR, np.stack([BAR, wound(turns)])) == pytest.approx(share, rel=0.1)


@pytest.mark.parametrize(("turns", "rise"), [(0.9, 0.5), (1.25, 1.2)])
def test_a_bar_beside_itself_does_not_count(turns, rise):
    assert crossed(TRIANGLES, BAR, wound(turns, rise)[None]) == 0.0


def test_what_crosses_at_rest_does_not_count():
    assert crossed(TRIANGLES, wound(1.25), wound(1.25)[None]) == 0.0
    more = crossed(TRIANGLES, wound(1.1), wound(1.5)[None])
    assert 0.0 < more < crossed(TRIANGLES, BAR, wound(1.5)[None])
