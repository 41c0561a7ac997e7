"""Sides of facets against the closed forms of the ball."""

import numpy as np
import pytest

from studies.geometry.mesh.organ_mesh import signed_volume, triangle_areas
from studies.geometry.shape.levelset import Shape, project
from studies.geometry.shape.regions import HalfSpace
from studies.geometry.surface.sides import (
    along_facets,
    lattice,
    outline_edges,
    region_area,
    shape_functions,
    with_middles,
)
from tests.studies.geometry.boxes import box, split

BALL = Shape("ball", lambda x: np.linalg.norm(x, axis=1) - 1.0, (-1.6, -1.6, -1.6), (1.6, 1.6, 1.6), 0.05)


@pytest.fixture(scope="module")
def surface():
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=3)
    return project(BALL, points / np.linalg.norm(points, axis=1, keepdims=True)), faces


def test_places_on_curved_facets_are_near_the_ball_and_on_straight_ones_not(surface):
    off = {}
    for curved in (False, True):
        places, pieces = along_facets(*with_middles(BALL, *surface, [], curved))
        off[curved] = np.abs(np.linalg.norm(places, axis=1) - 1.0).max()
        assert signed_volume(places, pieces) > 0
        assert len(pieces) == 16 * len(surface[1])
    assert off[True] < 0.1 * off[False]
    assert signed_volume(places, pieces) == pytest.approx(4 * np.pi / 3, rel=0.01)


def test_functions_of_a_facet_sum_to_one_and_are_exact_for_squares():
    values = shape_functions(lattice()[0], curved=True)
    assert np.allclose(values.sum(axis=1), 1.0)
    corners = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]])
    places = values @ corners
    assert np.allclose(values @ corners**2, places**2)


@pytest.mark.parametrize("height", [-0.6, 0.0, 0.31])
def test_the_area_inside_a_region_is_that_of_the_cap(height):
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=6)
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    region = HalfSpace((0.0, 0.0, height), (0.0, 0.0, 1.0))
    whole = triangle_areas(points, faces).sum()
    assert region_area(region, points, faces) / whole == pytest.approx((1.0 + height) / 2.0, rel=2e-3)


def test_middles_of_an_outline_lie_on_it(surface):
    points, faces = surface
    equator = HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    rim = outline_edges(points, faces, equator)
    assert len(rim) >= 8 and np.abs(points[np.unique(rim), 2]).max() < 1e-9
    nodes, facets = with_middles(BALL, points, faces, [equator], True)
    middles = nodes[facets[:, 3:].ravel()]
    on = np.abs(middles[:, 2]) < 1e-12
    assert on.sum() == 2 * len(rim)
    assert np.abs(np.linalg.norm(middles, axis=1) - 1.0).max() < 1e-9
