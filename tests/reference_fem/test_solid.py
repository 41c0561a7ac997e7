"""The second judge in three dimensions: at second order the reference's answer, and what else it must give."""

from dataclasses import replace

import numpy as np
import pytest

from reference_fem import (
    NeoHookean,
    PrescribedDisplacement,
    Problem,
    RigidCapsule,
    RigidPlane,
    RigidSphere,
    SolveError,
    crosscheck,
    curve,
    equilibrium_path,
    nodes,
)
from reference_fem.crosscheck import solid
from reference_fem.crosscheck.cases import facets_where
from reference_fem.oracles.bodies import whole_ball

needs_ngsolve = pytest.mark.skipif(
    not crosscheck.available(), reason="NGSolve is not installed: pip install organbench[crosscheck]"
)
TIMES = (0.5, 1.0)
PLANE = RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, -0.2 * t))
SPHERE = RigidSphere((1.5, 0.0, 0.2), 0.5, lambda t: (-0.1 * t, 0.0, 0.0))


@pytest.fixture(scope="module")
def ball():
    """A curved ball that stands on its lower cap, pulled aside there, under a plane and beside a sphere."""
    mesh = whole_ball(2)
    mesh = curve(mesh, lambda x: x / np.linalg.norm(x, axis=0), lambda x: np.linalg.norm(x, axis=0) > 1 - 1e-9)
    cap = facets_where(mesh, lambda x: x[2] < -0.4)
    held = PrescribedDisplacement(cap, motion=lambda t: (0.02 * t, 0.0, 0.0))
    return Problem(mesh, NeoHookean(1.0, 500.0), [held], [PLANE, SPHERE])


@pytest.fixture(scope="module")
def second_order(ball):
    """The judge at the order of the reference."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solid, "ORDER", solid.PATH_ORDER)
        return solid.solve_solid(ball, TIMES)


@needs_ngsolve
def test_at_second_order_it_is_the_reference(ball, second_order):
    """Same mesh and elements: quadrature and contact are left. Straight sides alone would move the force by 20 %."""
    ours = equilibrium_path(ball, TIMES)[-1]
    size = np.abs(ours.obstacle_force).max()
    np.testing.assert_allclose(second_order.obstacle_force, ours.obstacle_force, atol=0.01 * size)
    np.testing.assert_allclose(second_order.held_force, ours.held_force, atol=0.01 * size)
    points = nodes(ball.mesh)
    np.testing.assert_allclose(second_order.displacement(points), ours.u, atol=0.01 * np.abs(ours.u).max())


@needs_ngsolve
def test_forces_are_in_balance(second_order):
    """To Newton's tolerance: the potential and the force of an obstacle have the same points."""
    total = second_order.obstacle_force.sum(axis=0) + second_order.held_force.sum(axis=0)
    np.testing.assert_allclose(total, 0.0, atol=1e-7 * np.abs(second_order.held_force).max())
    assert (np.linalg.norm(second_order.obstacle_force, axis=1) > 0.05).all()
