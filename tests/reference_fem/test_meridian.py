"""The second judge's meridian: a ball with a converged solution, its own Newton, and the turn to three dimensions."""

import numpy as np
import pytest

from reference_fem import NeoHookean, SolveError, crosscheck
from reference_fem.crosscheck.meridian import Ball, MeridianMesh, between_planes, clamped_caps, quarter
from reference_fem.exact import BALL_BETWEEN_PLANES

pytestmark = pytest.mark.skipif(
    not crosscheck.available(), reason="NGSolve is not installed: pip install organbench[crosscheck]"
)
BALL = Ball(1.0, NeoHookean(1.0, 5000.0))
COARSE = MeridianMesh(0.3, 0)


@pytest.fixture(scope="module")
def clamped():
    return clamped_caps(BALL, 0.8, (0.02, 0.04), MeridianMesh(0.3, 2))


def test_the_ball_between_planes_has_the_known_force_and_equator():
    """Two dozen triangles: 1.2 % at the shallow push; a factor of two or π is far outside."""
    pressed = between_planes(BALL, (0.1, 0.2), COARSE)
    expected = np.array([BALL_BETWEEN_PLANES[share] for share in (0.10, 0.20)])
    np.testing.assert_allclose(pressed.force, expected[:, 0], rtol=0.02)
    (moved,) = pressed.displacement(np.array([[0.0, 1.0, 0.0]]))
    np.testing.assert_allclose(moved, [0.0, expected[1, 1] - 1.0, 0.0], atol=1e-3)


def test_the_quarter_is_a_quarter_of_the_disc_and_finer_at_the_edge():
    mesh = quarter(2.0, 1.6, MeridianMesh(0.3, 4))
    points = np.array([vertex.point for vertex in mesh.vertices])
    assert np.linalg.norm(points, axis=1).max() == pytest.approx(2.0, rel=1e-6)
    away = np.sort(np.linalg.norm(points - [1.2, 1.6], axis=1))
    assert away[0] < 1e-9
    assert away[1] < 0.3 * 2.0 / 3


def test_force_is_the_work_of_the_caps(clamped):
    """dΠ/d(push) of two caps is twice the force of one: small pushes have a linear force."""
    first, second = clamped.force
    assert first > 0
    assert second == pytest.approx(2 * first, rel=0.03)


def test_displacement_is_that_of_a_body_of_revolution(clamped):
    """Held caps go in by the push, the equator stays in its plane, and a turn about the axis turns the field."""
    cap, equator = clamped.displacement(np.array([[0.1, 0.2, -0.97], [0.6, 0.0, 0.0]]))
    np.testing.assert_allclose(cap, [0.0, 0.0, 0.04], atol=2e-3)
    assert abs(equator[2]) < 1e-12
    assert equator[0] > 0.005
    turned = clamped.displacement(np.array([[0.0, 0.6, 0.0]]))[0]
    np.testing.assert_allclose(turned, [0.0, equator[0], 0.0], atol=1e-12)


def test_too_long_a_step_is_refused():
    with pytest.raises(SolveError, match="take shorter steps"):
        clamped_caps(BALL, 0.8, (0.7,), COARSE)
