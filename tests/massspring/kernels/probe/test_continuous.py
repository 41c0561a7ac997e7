"""A moving point and a moving triangle, against closed forms, dense sampling and roots from numpy."""

import numpy as np
import pytest

from massspring.body.inside import is_inside, new_pair, surface_distance
from massspring.body.surface import winding_number
from massspring.kernels.probe.continuous import NEVER, crossing, nearest_into, touching
from tests.massspring.conftest import icosphere

FLAT = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
HIT = 1e-12  # of a step of some lengths: round-off of a cubic's coefficients


def pair_of(begin, end):
    pair = new_pair()
    pair.begin[:], pair.end[:] = begin, end
    return pair


def met(start, stop, triangle=FLAT, later=None):
    """A tip from `start` to `stop` and a triangle from its place to `later`."""
    later = triangle if later is None else later
    return pair_of(triangle - np.asarray(start, float), later - np.asarray(stop, float))


def test_a_point_falls_through_a_triangle():
    pair = met((0.2, 0.3, 0.5), (0.2, 0.3, -1.5))
    assert crossing(pair) == pytest.approx(0.25, abs=HIT)
    assert np.allclose(pair.weight, [0.5, 0.2, 0.3], atol=HIT)
    assert np.allclose(pair.direction, [0, 0, -1])  # from the tip into the tissue


@pytest.mark.parametrize("miss", [(0.7, 0.7), (-0.1, 0.5), (0.5, -1e-4)])
def test_a_point_beside_the_triangle_misses_it(miss):
    assert crossing(met((*miss, 1.0), (*miss, -1.0))) == NEVER


@pytest.mark.parametrize("rim", [(0.5, 0.0), (0.0, 0.5), (0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
def test_edges_and_corners_belong_to_the_triangle(rim):
    assert crossing(met((*rim, 1.0), (*rim, -1.0))) == pytest.approx(0.5, abs=1e-9)


def test_a_turning_triangle_meets_a_point_at_rest():
    """The tip lies at weights ½, ¼, ¼; corners that rise from −0.3 by 2 t, 0.4 t, 0.4 t pass it at −0.3 + 1.2 t = 0."""
    triangle = np.array([[1.0, 0.0, -0.3], [-1.0, 1.0, -0.3], [-1.0, -1.0, -0.3]])
    later = triangle + np.array([[0, 0, 2.0], [0, 0, 0.4], [0, 0, 0.4]])
    assert crossing(pair_of(triangle, later)) == pytest.approx(0.3 / 1.2, abs=HIT)


def test_there_and_back_again():
    """A triangle that shrinks to a point above the tip and grows again: f = (1 − 2 t)² z never changes sign."""
    above = FLAT - [0.25, 0.25, -0.2]
    mirrored = np.column_stack([-above[:, :2], above[:, 2]])
    assert crossing(pair_of(above, mirrored)) == NEVER
    # Through it and back within one step: two roots, the first counts.
    z = np.array([0.3, 0.1, 0.1])
    begin = np.column_stack([FLAT[:, :2] - 0.25, z])
    pair = pair_of(begin, begin - [[0, 0, 0.8], [0, 0, 0], [0, 0, 0]])
    heights = lambda t: 0.5 * (0.3 - 0.8 * t) + 0.25 * 0.1 + 0.25 * 0.1  # noqa: E731
    assert heights(crossing(pair)) == pytest.approx(0.0, abs=HIT)


def test_random_pairs_against_roots_from_numpy():
    """Outside truth: numpy's companion matrix and least-squares barycentric weights; 3,000 pairs."""
    rng = np.random.default_rng(0)
    hits, late = 0, 0
    for _ in range(3000):
        begin, end = rng.normal(size=(2, 3, 3))
        times = np.linspace(0, 1, 4)
        roots = np.roots(np.polyfit(times, [np.linalg.det(begin + t * (end - begin)) for t in times], 3))
        expected, order = NEVER, 0
        for t in np.sort(roots[np.abs(roots.imag) < 1e-9].real):
            order += 1
            if 0 <= t <= 1:
                corners = begin + t * (end - begin)
                weight = np.linalg.lstsq(np.vstack([corners.T, np.ones(3)]), [0, 0, 0, 1.0], rcond=None)[0]
                if (weight >= 0).all():
                    expected = t
                    break
        pair = pair_of(begin, end)
        assert crossing(pair) == pytest.approx(expected, abs=1e-7)
        if expected <= 1:
            hits, late = hits + 1, late + (order > 1)
            assert np.abs(pair.weight @ pair.corner).max() < 1e-7
            # Pushed back along `direction` the triangle lies on the tip's old side: the tip sees it there before.
            before = begin + (expected - 1e-5) * (end - begin)
            assert pair.weight @ before @ pair.direction > 0
    assert hits > 500 and late > 50, "the pairs miss too often to show anything"


def test_a_shared_edge_lets_nothing_through():
    """Tips on random paths through the edge of two triangles, and through a corner of six: at least one is met."""
    rng = np.random.default_rng(1)
    points, faces = icosphere(1)
    for _ in range(300):
        f = faces[rng.integers(len(faces))]
        share = rng.uniform() if rng.uniform() < 0.7 else 0.0
        on = points[f[0]] + share * (points[f[1]] - points[f[0]])
        way = on + 0.01 * rng.normal(size=3)
        start, stop = on + 0.3 * way, on - 0.8 * way
        drift = 0.3 * rng.normal(size=3)  # the surface moves as well, the same for tip and triangles
        assert min(crossing(met(start, stop + drift, points[t], points[t] + drift)) for t in faces) <= 1.0


def test_a_point_in_the_plane_meets_the_rim():
    pair = met((2.0, 0.25, 0.0), (0.5, 0.25, 0.0))
    assert crossing(pair) == pytest.approx((2.0 - 0.75) / 1.5, abs=1e-6)
    assert np.allclose(pair.direction, [-1, 0, 0])
    assert crossing(met((2.0, 2.0, 0.0), (2.0, -2.0, 0.0))) == NEVER


@pytest.mark.parametrize(
    "triangle",
    [FLAT[[0, 0, 1]], FLAT[[0, 0, 0]], np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]])],
    ids=["edge", "point", "line"],
)
def test_triangles_without_area_are_met_too(triangle):
    """A needle or a point hit head-on; the direction is against its motion, for it has no normal."""
    pair = met((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), triangle)
    assert crossing(pair) == pytest.approx(0.5, abs=1e-6)
    assert np.allclose(pair.direction, [0, 0, -1])


def test_rest_and_not_a_number_end():
    assert crossing(met((0.2, 0.2, 0.5), (0.2, 0.2, 0.5))) == NEVER
    assert crossing(pair_of(np.full((3, 3), np.nan), FLAT)) == NEVER


@pytest.mark.parametrize(
    ("start", "stop", "expected", "direction"),
    [
        ((0.2, 0.2, 1.0), (0.2, 0.2, -1.0), 0.45, (0, 0, -1)),  # face: 1 − 2 t = 0.1
        ((0.5, -1.0, 0.0), (0.5, 1.0, 0.0), 0.45, (0, 1, 0)),  # edge-on
        ((-1.0, -0.06, 0.0), (1.0, -0.06, 0.0), (1.0 - 0.08) / 2, (0.8, 0.6, 0)),  # corner: 0.06² + 0.08² = 0.1²
        ((0.2, 0.2, 1.0), (0.2, 0.2, 0.2), NEVER, None),
        ((-1.0, -0.11, 0.0), (1.0, -0.11, 0.0), NEVER, None),
    ],
    ids=["face", "edge", "corner", "short of it", "past it"],
)
def test_a_ball_first_touches_a_face_an_edge_a_corner(start, stop, expected, direction):
    pair = met(start, stop)
    assert touching(pair, 0.1) == pytest.approx(expected, abs=1e-6)
    if direction:
        assert np.allclose(pair.direction, direction, atol=1e-6)


def test_the_nearest_point_of_a_triangle_against_many():
    rng = np.random.default_rng(3)
    u = np.linspace(0, 1, 101)
    v, w = (a.ravel() for a in np.meshgrid(u, u))
    inside = v + w <= 1
    weights = np.column_stack([1 - v - w, v, w])[inside]
    weight = np.zeros(3)
    for _ in range(200):
        corners = rng.normal(size=(3, 3)) * rng.choice([1.0, 1e-3], size=3)
        distance = nearest_into(corners, weight)
        sampled = np.linalg.norm(weights @ corners, axis=1).min()
        assert (weight >= 0).all() and weight.sum() == pytest.approx(1)
        assert np.linalg.norm(weight @ corners) == pytest.approx(distance, abs=1e-12)
        assert distance <= sampled + 1e-12
        assert sampled - distance < 0.01 * 3  # a grid of a hundredth of the triangle


def test_which_side_of_a_surface_a_point_is_on():
    """Just inside and just outside a face, an edge, a corner; inside out, the surface goes round backwards."""
    points, faces = icosphere(2)
    a, b, c = points[faces[5]]
    for place in ((a + b + c) / 3, (a + b) / 2, a, 0.9 * a + 0.05 * b + 0.05 * c):
        assert winding_number(place * (1 - 1e-7), points, faces) == pytest.approx(1.0, abs=1e-6)
        assert winding_number(place * (1 + 1e-7), points, faces) == pytest.approx(0.0, abs=1e-6)
        assert winding_number(place * (1 - 1e-7), points, faces[:, ::-1]) == pytest.approx(-1.0, abs=1e-6)
    twice = np.concatenate([faces, faces])
    assert winding_number(np.zeros(3), points, twice) == pytest.approx(2.0, abs=1e-12)
    assert is_inside(0.5 * a, points, faces) and not is_inside(1.5 * a, points, faces)


def test_the_distance_to_a_surface_against_every_triangle():
    points, faces = icosphere(2)
    rng, weight = np.random.default_rng(8), np.zeros(3)
    points = points + 0.01 * rng.normal(size=points.shape)
    for tip in 0.06 * rng.normal(size=(50, 3)):
        assert surface_distance(tip, points, faces) == min(nearest_into(points[f] - tip, weight) for f in faces)
