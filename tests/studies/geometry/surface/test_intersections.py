"""Self-intersections: known cases, brute force, and decisions at the edge of rounding."""

from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest

from studies.geometry.surface.intersections import crossing_triangles, orientation, orientation_2, overlapping_boxes
from tests.studies.geometry.boxes import box, split

ROT = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]


def determinant(rows):
    """Sign by fractions."""
    if len(rows) == 2:
        value = rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0]
    else:
        (a, b, c), (d, e, f), (g, h, i) = rows
        value = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return (value > 0) - (value < 0)


def test_orientation_is_exact_near_a_plane():
    generator = np.random.default_rng(0)
    a, b, c = generator.uniform(0.5, 1.0, (3, 300, 3))
    s, t = generator.uniform(0, 1, (2, 300, 1))
    d = a + s * (b - a) + t * (c - a)  # in the plane up to rounding
    signs = orientation(a, b, c, d)
    exact = [determinant(_rows(a[k], b[k], c[k], d[k])) for k in range(300)]
    assert signs.tolist() == exact
    assert {-1, 1} <= set(exact)
    rounded = np.sign(np.einsum("ij,ij->i", a - d, np.cross(b - d, c - d)))
    assert (rounded != exact).any()  # plain floating point gets some signs wrong


def _rows(a, b, c, d):
    return [[Fraction(float(x)) - Fraction(float(y)) for x, y in zip(p, d, strict=True)] for p in (a, b, c)]


def test_orientation_in_the_plane_is_exact():
    a, b = np.full((64, 2), 12.0), np.full((64, 2), 24.0)
    i, j = np.divmod(np.arange(64), 8)
    c = np.stack([0.5 + i * 2.0**-53, 0.5 + j * 2.0**-53], axis=1)  # Kettner's example
    exact = [determinant([[Fraction(12) - Fraction(x) for x in p], [Fraction(24) - Fraction(x) for x in p]]) for p in c]
    assert orientation_2(a, b, c).tolist() == exact


def test_boxes_that_touch_are_found_once():
    generator = np.random.default_rng(1)
    low = generator.uniform(0, 1, (257, 3))
    high = low + generator.uniform(0, 0.2, (257, 3)) ** 2
    high[7] = low[7] + 1.0  # one that touches many
    overlaps = np.concatenate(list(overlapping_boxes(low, high)))
    pairs = [p for p in combinations(range(257), 2) if (low[list(p)].max(axis=0) <= high[list(p)].min(axis=0)).all()]
    assert sorted(map(tuple, overlaps.tolist())) == pairs


@pytest.mark.parametrize("turn", [np.eye(3), ROT])
def test_sound_surfaces_cross_nowhere(turn):
    # Flat faces: every neighbour is in the plane, exactly so or, turned, up to rounding.
    points, faces = split(*box(), times=3)
    assert len(crossing_triangles(points @ turn, faces)) == 0


def test_pierced_triangles_are_found():
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    needle = np.array([[0.2, 0.2, -1], [0.2, 0.2, 1], [0.2, 0.3, 1]])
    faces = np.array([[0, 1, 2], [3, 4, 5]])

    def meets(shift):
        return len(crossing_triangles(np.vstack([triangle, needle + shift]), faces)) == 1

    assert meets((0, 0, 0)) and meets((0.5, 0, 0)) and meets((-0.2, 0, 0))  # inside, and on either edge
    assert meets((0, 0, 1)) and meets((0, 0, -1))  # one corner or an edge just touches
    assert not meets((0, 0, np.nextafter(1, 2))) and not meets((0.7, 0, 0)) and not meets((-0.2 - 1e-15, 0, 0))


def test_touching_in_one_point_counts_whichever_way_round():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1.2, -0.1, 1], [1.3, 0.1, 0.9]], float)
    faces = np.array([[[0, 1, 2], [3, 4, 5]], [[0, 2, 1], [3, 5, 4]]])
    assert [len(crossing_triangles(points, pair)) for pair in faces] == [1, 1]
    points[3, 2] = 1e-300
    assert [len(crossing_triangles(points, pair)) for pair in faces] == [0, 0]


def test_triangles_in_one_plane():
    base = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], float)
    faces = np.array([[0, 1, 2], [3, 4, 5]])
    for shift, expected in (
        ((0.5, 0.5), 1),
        ((3, 3), 0),
        ((4, 0), 1),
        ((4.1, 0), 0),
        ((-0.5, -0.5), 1),
        ((-1, -1), 0),
        ((0, -0.5), 1),
    ):
        other = 0.25 * base + (*shift, 0)
        for turn in (np.eye(3), np.eye(3)[[2, 0, 1]]):
            assert len(crossing_triangles(np.vstack([base, other]) @ turn, faces)) == expected


def test_neighbours_count_only_beyond_what_they_share():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.3, 0], [0.2, 0.3, 0.1], [1, 1, 0], [2, 1, 1]], float)
    fold, roof, flat = [0, 1, 3], [0, 1, 4], [1, 2, 5]
    first = [0, 1, 2]

    def cross(*faces):
        return crossing_triangles(points, np.array(faces)).tolist()

    assert cross(first, fold) == [[0, 1]] and cross(first, roof) == [] and cross(first, flat) == []
    assert cross(first, [1, 5, 6]) == []  # one node in common and nothing else
    assert cross(first, [0, 3, 6]) == [[0, 1]]  # one node in common, and an edge inside
    assert cross(first, [0, 4, 3]) == [[0, 1]]
    assert cross(first, [0, 2, 1]) == [] and cross(first, [0, 0, 3]) == []  # duplicates and collapsed are other faults


def test_random_triangles_against_brute_force():
    generator = np.random.default_rng(3)
    points = generator.uniform(0, 1, (120, 3))
    faces = np.arange(120).reshape(-1, 3)
    crossings = {tuple(p) for p in crossing_triangles(points, faces).tolist()}
    expected = set()
    for i, j in combinations(range(40), 2):
        a, b = points[faces[i]], points[faces[j]]
        if any(pierces(p, q, t) for s, t in ((a, b), (b, a)) for p, q in ((s[0], s[1]), (s[1], s[2]), (s[2], s[0]))):
            expected.add((i, j))
    assert crossings == expected and len(crossings) > 20


def pierces(p, q, t):
    """Moeller and Trumbore's way, good enough away from edges."""
    u, v, d = t[1] - t[0], t[2] - t[0], q - p
    x = np.linalg.solve(np.stack([u, v, -d], axis=1), p - t[0])
    return bool(x[0] >= 0 and x[1] >= 0 and x[0] + x[1] <= 1 and 0 <= x[2] <= 1)
