"""The smallest volume ratio of a body's elements, against determinants of maps in closed form."""

import numpy as np
import pytest

from massspring import quadratic_body
from massspring.body.points import FAR
from massspring.body.volumes import tetrahedron_volumes
from tests.massspring.conftest import SOFT
from tests.massspring.quadratic import bodies, second_order

SHEARED = np.array([[1.1, 0.2, 0.0], [-0.1, 0.95, 0.1], [0.05, 0.0, 1.2]])
MIRRORED = np.diag([1.0, 1.0, -1.0])
EDGE = 0.02


@pytest.fixture(params=["block_body", *bodies()])
def solid(request):
    return bodies()[request.param] if request.param in bodies() else request.getfixturevalue(request.param)


@pytest.mark.parametrize("map_", [np.eye(3), SHEARED, MIRRORED], ids=["rest", "sheared", "mirrored"])
def test_a_linear_map_has_its_determinant_everywhere(solid, map_):
    assert solid.smallest_ratio(solid.rest @ map_.T) == pytest.approx(np.linalg.det(map_), rel=1e-9)


def test_the_smallest_counts(solid):
    """One node moved: some elements lose volume, others gain it."""
    x = solid.rest.copy()
    x[np.argmin(np.linalg.norm(x - x.mean(axis=0), axis=1))] += 0.1 * EDGE
    assert solid.smallest_ratio(x) < 1.0 - 1e-3


@pytest.mark.filterwarnings("ignore:invalid value encountered in det")
def test_no_number_is_seen(solid):
    x = solid.rest.copy()
    x[-1, 1] = np.nan
    assert np.isnan(solid.smallest_ratio(x))


def test_a_surface_has_no_elements(ball_body):
    assert np.isnan(ball_body.smallest_ratio(ball_body.rest))


def test_a_quadratic_element_is_read_at_its_points():
    """x → x + a (x/L − 1)² L has J = 1 + 2a (x/L − 1): negative at three corners, 1 − 1.5 a in the flat parts between
    its nodes there, and positive at its points, where springs and volumes see it."""
    a = 0.55
    points, cells = second_order(EDGE * np.vstack([np.zeros(3), np.eye(3)]), np.arange(4)[None])
    body = quadratic_body(points, cells, SOFT)
    x = points.copy()
    x[:, 0] += a * EDGE * (points[:, 0] / EDGE - 1.0) ** 2
    at_points, in_parts = 1.0 + 2.0 * a * (FAR - 1.0), 1.0 - 1.5 * a
    assert body.smallest_ratio(x) == pytest.approx(at_points, rel=1e-9)
    parts = tetrahedron_volumes(x, body.tetrahedra) / body.tetrahedron_volumes
    assert parts.min() == pytest.approx(in_parts, rel=1e-9) and 1.0 - 2.0 * a < 0.0 < at_points < in_parts
