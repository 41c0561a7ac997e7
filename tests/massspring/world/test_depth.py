"""How deep a body lies in round obstacles, and whether these have been inside it."""

import numpy as np
import pytest

from massspring import Capsule, Sphere, Trajectory, quadratic_body
from massspring.world.depth import deepest, facets_within
from tests.massspring.conftest import SOFT, icosphere
from tests.massspring.quadratic import RADIUS, ball_mesh, bricks

BALL = (lambda points, triangles: (points, triangles.astype(np.uint32)))(*icosphere(3, 1.0))
RADIUS_OF_TOOL = 0.1


def along_z(*heights: float, seconds: float = 1.0) -> Trajectory:
    """A path through these heights, one each so many seconds."""
    return Trajectory(tuple(seconds * np.arange(len(heights))), tuple((0.0, 0.0, z) for z in heights))


def sphere(path: Trajectory) -> Sphere:
    return Sphere((0.01, 0.02, 0.0), RADIUS_OF_TOOL, path)


def test_a_thin_sphere_is_deep_between_the_nodes_of_a_facet():
    """Flat top of a block, corners 20 mm apart: a sphere of 2 mm in the middle of a facet is far from every node."""
    body = quadratic_body(*bricks((2, 2, 2), (0.04, 0.04, 0.04)), SOFT)
    tool = Sphere((0.012, 0.007, 0.0415), 0.002)
    assert tool.gap(body.rest, 0.0).min() > 0.0
    depth, inside = deepest(tool, body.rest, body.contact_facets, body.triangles, 0.0)
    assert depth == pytest.approx(0.0005, rel=1e-9) and not inside
    assert deepest(tool, body.rest, body.triangles, body.triangles, 0.0)[0] == pytest.approx(depth, rel=1e-9)
    assert facets_within(tool, body.rest, body.contact_facets, 0.0).sum() == 1


def test_curved_facets_are_deeper_than_their_flat_parts():
    """Quadratic facets with all nodes on a sphere: the depth along a radius through none of them is that of the sphere,
    far within the sag of the flat parts."""
    body = quadratic_body(*ball_mesh(), SOFT)
    way = np.array([0.31, 0.55, 0.43]) / np.linalg.norm([0.31, 0.55, 0.43])
    tool = Sphere(tuple((RADIUS + 0.009) * way), 0.01)
    curved, flat = (
        deepest(tool, body.rest, facets, body.triangles, 0.0)[0] for facets in (body.contact_facets, body.triangles)
    )
    assert abs(curved - 0.001) < 1e-4 and flat < curved - 2e-4


@pytest.mark.parametrize("height", [0.5, 0.0, -0.5])
def test_a_centre_inside_is_deeper_than_the_radius(height):
    depth, inside = deepest(sphere(along_z(height)), *_flat(), 0.0)
    off_axis = np.hypot(0.01, 0.02)
    assert inside and depth == pytest.approx(RADIUS_OF_TOOL + 1.0 - np.hypot(height, off_axis), abs=0.01)


def _flat() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    points, triangles = BALL
    return points, triangles, triangles


def test_a_rod_is_inside_where_both_its_ends_are_outside():
    rod = Capsule((-2.0, 0.0, 0.1), (2.0, 0.1, 0.2), 0.05)
    assert deepest(rod, *_flat(), 0.0)[1]
    beside = Capsule((-2.0, 0.0, 1.1), (2.0, 0.1, 1.2), 0.05)
    assert deepest(beside, *_flat(), 0.0) == (pytest.approx(0.05 - 0.125, abs=0.04), False)


@pytest.mark.parametrize("tool", [sphere(along_z(2.0, -2.0)), Capsule((-2, 0, 0), (10, 0, 0), 0.1, along_z(2.0, -2.0))])
def test_what_goes_through_within_a_frame_is_seen(tool):
    """A rod sideways: its ends pass beside the body."""
    points, triangles = BALL
    depth, inside = deepest(tool, points, triangles, triangles, 1.0, (points, 0.0))
    assert inside and depth < 0.0
    assert not deepest(tool, points, triangles, triangles, 1.0)[1]  # its end alone does not tell


def test_a_way_there_and_back_within_a_frame_is_seen():
    points, triangles = BALL
    there_and_back = sphere(along_z(2.0, 0.0, 2.0, seconds=0.5))
    assert deepest(there_and_back, points, triangles, triangles, 1.0, (points, 0.0))[1]


@pytest.mark.parametrize("leaves", [False, True])
def test_what_pushes_the_surface_and_leaves_it_is_outside(leaves):
    """In one frame by half the body: the surface is below it in the end, or in the beginning."""
    points, triangles = BALL
    pressed = points * [1.0, 1.0, 1.0]
    pressed[:, 2] = np.minimum(pressed[:, 2], 0.4)
    before, after, way = (pressed, points, (0.55, 1.2)) if leaves else (points, pressed, (1.2, 0.55))
    assert not deepest(sphere(along_z(*way)), after, triangles, triangles, 1.0, (before, 0.0))[1]
