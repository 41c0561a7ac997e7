"""First surfaces of all shapes, and edits of a net: nodes come and go, edges turn."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import ball, check_surface
from studies.geometry.mesh.organ_mesh import triangle_areas, unique_edges
from studies.geometry.organs import SHAPES
from studies.geometry.shape.levelset import Shape, project
from studies.geometry.surface.first_surface import first_surface
from studies.geometry.surface.node_count import collapse_edge, flip_edges, split_edge, surface_with, with_node_count

BALL = SHAPES["ball"](0.05)


@pytest.fixture(scope="module")
def net():
    """A closed net of 150 nodes on the ball."""
    mesh = ball(150, fill=False)
    return mesh.points, mesh.triangles


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_first_surface_is_closed_smooth_and_on_the_shape(name):
    shape = SHAPES[name]()
    points, triangles = first_surface(shape)
    check_surface(points, triangles)
    assert np.abs(shape.level(points)).max() < 1e-12 * shape.size
    assert len(points) - len(unique_edges(triangles)) + len(triangles) == 2
    # 1,300 facets of the ball lose 0.4 per cent.
    assert name != "ball" or triangle_areas(points, triangles).sum() == pytest.approx(4 * np.pi * 0.05**2, rel=0.01)


def test_a_shape_outside_its_box_is_refused():
    for low, high in (((-0.04,) * 3, (0.04,) * 3), ((0.1,) * 3, (0.2,) * 3)):
        with pytest.raises(StudyError, match="not inside its box"):
            first_surface(Shape("egg", BALL.level, low, high, cell=0.01))


@pytest.mark.parametrize("change", [1, 4, -1, -4])
def test_single_nodes_come_and_go(net, change):
    points, triangles = with_node_count(*net, 150 + change)
    points = project(BALL, points)
    check_surface(points, triangles)
    assert len(points) == 150 + change and len(triangles) == 296 + 2 * change


def test_split_and_collapse_undo_each_other(net):
    points, triangles = net
    edge = unique_edges(triangles)[7]
    more, faces = split_edge(points, triangles, edge)
    check_surface(more, faces)
    fewer, back = collapse_edge(more, faces, np.array([edge[0], 150]))
    check_surface(fewer, back)
    assert {frozenset(row) for row in back.tolist()} == {frozenset(row) for row in triangles.tolist()}


def test_turning_an_edge_mends_a_bad_quadrilateral_only(net):
    points, triangles = net
    edges = unique_edges(triangles)
    assert (flip_edges(points, triangles, edges, lambda k, m: False, 1.0) == triangles).all()
    # Turn one edge for the worse (any quality allowed), then ask for the better: the first net comes back.
    worse = flip_edges(points, triangles, edges[:1], lambda k, m: True, 0.0)
    check_surface(points, worse)
    assert (worse != triangles).any()
    changed = np.setdiff1d(worse[(worse != triangles).any(axis=1)], edges[0])
    better = flip_edges(points, worse, changed[None], lambda k, m: True, 1.0)
    assert {frozenset(row) for row in better.tolist()} == {frozenset(row) for row in triangles.tolist()}


def test_a_search_that_cannot_succeed_ends_with_a_sentence(net):
    with pytest.raises(StudyError, match="no well-shaped surface with 400 nodes in 12 tries"):
        surface_with(400, 0.03, lambda size: net, BALL)
    folded = net[0], net[1][:, ::-1]
    with pytest.raises(StudyError, match="no well-shaped surface with 150 nodes"):
        surface_with(150, 0.03, lambda size: folded, BALL)
