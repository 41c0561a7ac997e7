"""The point of a facet nearest to the axis of a round obstacle."""

import numpy as np
import pytest

from massspring.body.surface import winding_number
from massspring.kernels.contact.nearest import distance_to_axis, nearest_of_facet, passes_surface, within_into
from massspring.layout.facet_rows import CORNER
from tests.massspring.conftest import icosphere

STRAIGHT, CURVED = np.arange(3, dtype=np.uint32)[None], np.arange(6, dtype=np.uint32)[None]
MIDDLES = CORNER[:, :2]


def shape(b):
    return np.concatenate([b * (2.0 * b - 1.0), 4.0 * np.prod(b[..., MIDDLES], axis=-1)], axis=-1)


def cases(seed, curved):
    """Facets of size 1, curved ones with middles up to a sixth of the shortest side off; points and segments."""
    random = np.random.default_rng(seed)
    for number in range(200):
        x = random.standard_normal((3, 3))
        if curved:
            off = 0.1 * np.linalg.norm(x - np.roll(x, 1, axis=0), axis=1).min()
            x = np.vstack([x, x[MIDDLES].mean(axis=1) + off * random.uniform(-1.0, 1.0, (3, 3))])
        axis = random.standard_normal(3) * (number % 4 > 0) * random.choice([0.1, 1.0, 5.0])
        yield x, random.choice([0.3, 1.0, 5.0]) * random.standard_normal(3), axis


def grid(x, o, a, count):
    """Distance by a search over all points of a grid of the facet."""
    i, j = np.mgrid[0 : count + 1, 0 : count + 1]
    inside = i + j <= count
    b = np.stack([count - i - j, i, j], axis=-1)[inside] / count
    y = (b if len(x) == 3 else shape(b)) @ x - o
    share = np.clip(y @ a / (a @ a), 0.0, 1.0)[:, None] if a.any() else 0.0
    return np.linalg.norm(y - share * a, axis=1).min()


@pytest.mark.parametrize("curved", [False, True])
def test_nearest_point_is_that_of_a_fine_grid(curved):
    """Never farther than any point of a grid, and by no more nearer than the grid is coarse; its weights are there."""
    worst, missed = 0.0, 0
    for x, o, a in cases(0, curved):
        node, count = (CURVED if curved else STRAIGHT), 150
        square, b = nearest_of_facet(x, node, 0, tuple(o), tuple(a))
        b = np.array(b)
        assert b.min() >= -1e-12 and b.sum() == pytest.approx(1.0)
        y = (shape(b) if curved else b) @ x - o
        share = np.clip(y @ a / (a @ a), 0.0, 1.0) if a.any() else 0.0
        found = np.sqrt(square)
        assert np.linalg.norm(y - share * a) == pytest.approx(found, abs=1e-9)
        size, by_grid = np.ptp(x, axis=0).max(), grid(x, o, a, count)
        missed += found > by_grid + 1e-4 * size
        worst = max(worst, (by_grid - found) / size)
    assert missed == 0 and worst < 0.02


def test_a_surface_is_passed_between_inside_and_outside():
    """By the solid angle, which knows no crossings: a path with one end inside passes, one in a half-space without the
    body does not."""
    random, (points, triangles) = np.random.default_rng(1), icosphere(2, 1.0)
    triangles = triangles.astype(np.uint32)
    ends = random.uniform(-1.2, 1.2, (300, 2, 3))
    inside = np.array([[abs(winding_number(end, points, triangles)) > 0.5 for end in pair] for pair in ends])
    passes = np.array([passes_surface(p, q, q, points, triangles) for p, q in ends])
    one, far = (
        inside[:, 0] != inside[:, 1],
        (ends.min(axis=1) > 1.0).any(axis=1) | (ends.max(axis=1) < -1.0).any(axis=1),
    )
    both = inside.all(axis=1)
    assert one.sum() > 50 and passes[one].all() and far.sum() > 10 and not passes[far].any()
    assert both.sum() > 10 and not passes[both].any()  # a ball is convex
    # A swept segment that passes on both sides of a rod meets it only within.
    wide = np.array([[-3.0, 0.3, 0.0], [3.0, 0.2, 0.0], [-3.0, 0.3, 9.0]])
    above = wide + np.array([0.0, 0.0, 1.1])
    assert passes_surface(*wide, points, triangles) and not passes_surface(*above, points, triangles)


@pytest.mark.parametrize("curved", [False, True])
def test_distance_of_a_surface_is_the_least_of_its_facets(curved):
    """Whatever order boxes are left out in; and as many facets are within it."""
    rows = [x for x, _, _ in cases(3, curved)]
    size = len(rows[0])
    points, node = np.concatenate(rows), np.arange(size * len(rows), dtype=np.uint32).reshape(-1, size)
    for _, o, a in cases(4, curved):
        o = 3.0 * o
        all_of = [nearest_of_facet(points, node, f, tuple(o), tuple(a))[0] ** 0.5 for f in range(len(node))]
        assert distance_to_axis(points, node, o, a) == pytest.approx(min(all_of), rel=1e-12)
        reach = float(np.quantile(all_of, 0.3)) + 0.1
        within_into(points, node, o, a, reach, near := np.zeros(len(node), dtype=bool))
        assert (near == (np.array(all_of) < reach)).all() and near.sum() > 30
