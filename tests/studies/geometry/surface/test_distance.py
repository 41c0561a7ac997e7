"""Distances between surfaces, against closed forms and against dense sampling."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from studies.geometry.surface.distance import ChangingFacets, SurfaceDistance, distance_to_surface, hausdorff
from tests.studies.tiny import cube

TRIANGLE = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
ONE = np.array([[0, 1, 2]])
REGIONS = {
    "face": ((1.0, 1.0, 2.0), 2.0),
    "inside": ((1.0, 1.0, 0.0), 0.0),
    "edge ab": ((2.0, -3.0, 4.0), 5.0),
    "edge ca": ((-3.0, 1.0, -4.0), 5.0),
    "edge bc": ((2.0 + 3.0, 1.5 + 4.0, 0.0), 5.0),
    "vertex a": ((-2.0, -1.0, 2.0), 3.0),
    "vertex b": ((5.0, -2.0, 2.0), 3.0),
    "vertex c": ((-1.0, 5.0, -2.0), 3.0),
}


@pytest.mark.parametrize(("query", "distance"), REGIONS.values(), ids=REGIONS)
def test_each_region_of_a_triangle(query, distance):
    distances = distance_to_surface(np.array([query]), TRIANGLE, ONE)
    assert distances == pytest.approx([distance], abs=1e-14)


def test_a_triangle_without_area_is_its_longest_side():
    """Beyond its ends, on its line, the normal is rounding and would put every tenth point onto it."""
    rng = np.random.default_rng(1)
    a, way, share, place = (rng.uniform(-1, 2, size=(300, width)) for width in (3, 3, 1, 1))
    for k in range(300):
        middle = np.abs(share[k]) / 2
        flat = np.array([a[k], a[k] + way[k], a[k] + middle * way[k]])
        beyond = np.abs(place[k] - np.clip(place[k], 0, 1)) * np.linalg.norm(way[k])
        distances = distance_to_surface((a[k] + place[k] * way[k])[None], flat, ONE)
        np.testing.assert_allclose(distances, beyond, atol=1e-12)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_a_soup_is_all_its_triangles(seed):
    """Long triangles among short ones: the nearest one need not have a near centroid."""
    random = np.random.default_rng(seed)
    centres = random.uniform(-1, 1, (80, 1, 3))
    corners = centres + random.uniform(-1, 1, (80, 3, 3)) * 10.0 ** random.uniform(-2, 0.5, (80, 1, 1))
    queries = random.uniform(-1, 1, (20, 3))
    triangles = np.arange(240).reshape(80, 3)
    distances = distance_to_surface(queries, corners.reshape(-1, 3), triangles)
    single = [distance_to_surface(queries, c, ONE) for c in corners]
    np.testing.assert_allclose(distances, np.min(single, axis=0), rtol=1e-12, atol=1e-14)


def test_shifted_planes_and_symmetry():
    points, triangles, _ = cube(3)
    shift = np.array([0.0, 0.0, 0.013])
    assert hausdorff(points, triangles, points + shift, triangles) == pytest.approx(0.013, rel=1e-12)
    spike = points.copy()
    spike[np.argmax(points @ np.array([1.0, 1.1, 1.2]))] *= 1.5
    ways = hausdorff(points, triangles, spike, triangles), hausdorff(spike, triangles, points, triangles)
    # Seen from one side alone the spike would be missed: its length is what both orders must give.
    assert ways[0] == ways[1] == pytest.approx(0.5 * np.linalg.norm([0.05] * 3), rel=1e-12)
    assert distance_to_surface(points[np.unique(triangles)], spike, triangles).max() < 0.5 * ways[0]


def soup(random, facets):
    """Facets without a common point: places (t, 6, 3) at corners and middles, and the four flat pieces of one."""
    centres = random.uniform(-1.0, 1.0, (facets, 1, 3))
    corners = centres + random.uniform(-0.3, 0.3, (facets, 3, 3))
    return np.concatenate([corners, 0.5 * (corners + np.roll(corners, -1, axis=1))], axis=1)


PIECES = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 2**32 - 1))
def test_distances_of_changing_facets_are_the_same_to_the_bit(seed):
    """Facets come, go, change places in the list, and move by one rounding."""
    random = np.random.default_rng(seed)
    points, triangles, _ = cube()
    changing, places = ChangingFacets(points, triangles), soup(random, 30)
    for _ in range(6):
        ahead, behind = changing.measure(places, PIECES)
        whole = places.reshape(-1, 3), np.concatenate([6 * k + PIECES for k in range(len(places))])
        np.testing.assert_array_equal(ahead, SurfaceDistance(*whole)(points))
        np.testing.assert_array_equal(behind.ravel(), SurfaceDistance(points, triangles)(whole[0]))
        kept = random.permutation(len(places))[: random.integers(1, 30)]
        places = np.concatenate([places[kept], soup(random, random.integers(0, 6))])
        places[0, 1] = np.nextafter(places[0, 1], 9.0)


def test_facets_that_stay_are_not_measured_again(monkeypatch):
    points, triangles, _ = cube()
    changing, places = ChangingFacets(points, triangles), soup(np.random.default_rng(2), 40)
    measured, nearest = [], SurfaceDistance.nearest
    monkeypatch.setattr(SurfaceDistance, "nearest", lambda self, q: measured.append(len(q)) or nearest(self, q))
    changing.measure(places, PIECES)
    assert measured == [40 * 6, len(points)]
    changing.measure(places, PIECES)
    assert measured[2:] == [0]
    changing.measure(places[1:], PIECES)
    assert measured[3] == 0 and sum(measured[4:]) < len(points)
