"""Nodes where even ones cut corners, and none that spoils the mesh or an outline."""

import numpy as np
import pytest

from studies.geometry.mesh.organ_mesh import unique_edges
from studies.geometry.mesh.quality import triangle_radius_ratio
from studies.geometry.shape.levelset import Shape, project
from studies.geometry.shape.regions import HalfSpace
from studies.geometry.surface.first_surface import first_surface
from studies.geometry.surface.fit import ENOUGH, FEWEST_AT_OUTLINE, Fit, fitted, folds
from studies.geometry.surface.intersections import crossing_triangles
from studies.geometry.surface.node_count import QUALITY
from studies.geometry.surface.sides import outline_edges, region_side
from studies.geometry.surface.snap import crossing_edges
from tests.studies.geometry.boxes import box, split

TIP = np.array([0.3, 0.25, 0.92]) / np.linalg.norm([0.3, 0.25, 0.92])
"""Between the nodes of the coarse mesh."""


def tipped(points):
    """A ball of radius 1 with one narrow tip, 0.4 high."""
    radius = np.linalg.norm(points, axis=1)
    cosine = points @ TIP / np.maximum(radius, 1e-9)
    return radius - 1.0 - 0.4 * np.exp(-(((cosine - 1.0) / 0.04) ** 2))


SHAPE = Shape("tipped ball", tipped, (-1.6, -1.6, -1.6), (1.6, 1.6, 1.6), 0.1)
BALL = Shape("ball", lambda x: np.linalg.norm(x, axis=1) - 1.0, (-1.6, -1.6, -1.6), (1.6, 1.6, 1.6), 0.05)
CAP = HalfSpace((0.0, 0.0, -0.6), (0.0, 0.0, 1.0))


def surface_of(shape, times):
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=times)
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    # Along rays: both shapes are stars.
    for _ in range(50):
        points = points * (1.0 - shape.level(points) / np.linalg.norm(points, axis=1))[:, None]
    return project(shape, points), faces


@pytest.fixture(scope="module")
def truth():
    return first_surface(SHAPE)


@pytest.fixture(scope="module")
def coarse():
    return surface_of(SHAPE, 3)


@pytest.mark.parametrize("curved", [False, True])
def test_nodes_go_where_the_surface_is_far_from_its_shape(truth, coarse, curved):
    fit = Fit(SHAPE, coarse, [], truth, curved)
    before = fit.deviation()
    fit.grow(len(coarse[0]) + 14)
    points, triangles = fit.surface
    assert before > 2 * ENOUGH and fit.deviation() <= max(0.4 * before, ENOUGH)
    assert len(points) == len(coarse[0]) + 14 and len(triangles) == 2 * len(points) - 4
    assert (points[: len(coarse[0])] == coarse[0]).all()
    assert np.abs(SHAPE.level(points)).max() < 1e-9
    assert triangle_radius_ratio(points, triangles).min() > QUALITY and len(crossing_triangles(points, triangles)) == 0
    # Most of the new nodes are at the tip.
    assert (points[len(coarse[0]) :] @ TIP > 0.8).mean() > 0.5


def test_both_directions_count():
    """A surface that is a tenth too long, and one that is a tenth too short: the same deviation."""
    truth = surface_of(BALL, 5)
    small = surface_of(BALL, 4)
    size = np.linalg.norm([2.0, 2.0, 2.0])
    for stretch in (0.9, 1.1):
        fit = Fit(BALL, (small[0] * [1.0, 1.0, stretch], small[1]), [], truth, False)
        assert fit.deviation() == pytest.approx(0.1 / size, rel=0.04)  # with the sagitta of the facets


def test_a_surface_that_is_near_enough_gets_no_node():
    fit = Fit(BALL, surface_of(BALL, 3), [], surface_of(BALL, 5), True)
    count = len(fit.points)
    fit.grow(count + 5)
    assert len(fit.points) == count
    fit.split_longest(count + 5)
    assert len(fit.points) == count + 5


def test_outlines_stay_on_edges_and_have_nodes_enough(truth, coarse):
    nodes = len(coarse[0]) + 40
    fit = fitted(SHAPE, coarse, nodes, [CAP], truth, True)
    points, triangles = fit.surface
    assert len(points) == nodes and len(crossing_triangles(points, triangles)) == 0
    assert len(crossing_edges(CAP, points, unique_edges(triangles), 1e-9)) == 0
    rim = outline_edges(points, triangles, CAP)
    assert len(rim) >= FEWEST_AT_OUTLINE
    assert np.abs(points[np.unique(rim), 2] + 0.6).max() < 1e-9
    # The cap of a ball: 2 pi r h.
    assert fit.area_error() < 0.02
    inside = (region_side(CAP, points) <= 0)[triangles].all(axis=1)
    assert inside.any() and not inside.all()


def test_the_area_of_a_region_is_judged():
    truth = surface_of(BALL, 5)
    fit = fitted(BALL, surface_of(BALL, 3), 120, [CAP], truth, True)
    assert fit.badness() <= 1.0
    fit.regions = [HalfSpace((0.0, 0.0, -0.5), (0.0, 0.0, 1.0))]
    # No edge lies on this outline, so facets that it crosses do not count.
    assert fit.area_error() > 0.05 and fit.badness() > 1.0


def test_a_node_that_folds_the_surface_is_refused():
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, 0.9, 0.1], [0.5, -1, 0]], float)
    assert folds(points, np.array([[0, 1, 2], [1, 0, 3]]), 3)
    assert not folds(points, np.array([[0, 1, 2], [1, 0, 4]]), 4)


def test_all_four_sides_around_a_new_node_may_turn(truth):
    """A square whose outer neighbours are slivers: each side is better turned to the new node in its middle."""
    corners = [[-1, 0, 0], [0, -1, 0], [1, 0, 0], [0, 1, 0]]
    outside = [[-0.6, -0.6, 0], [0.6, -0.6, 0], [0.6, 0.6, 0], [-0.6, 0.6, 0]]
    points = np.array([*corners, *outside, [0, 0, -3]], float)
    square = [[0, 1, 2], [2, 3, 0]]
    slivers = [[k, 4 + k, (k + 1) % 4] for k in range(4)]
    ring = [node for k in range(4) for node in (k, 4 + k)]
    below = [[8, ring[(k + 1) % 8], ring[k]] for k in range(8)]
    fit = Fit(SHAPE, (points, np.array([*square, *slivers, *below])), [], truth, False)
    assert fit.split(np.array([0, 2]), np.zeros(3), False)
    assert (fit.triangles == 9).sum() == 8
