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
from reference_fem.oracles.bodies import block, whole_ball

needs_ngsolve = pytest.mark.skipif(
    not crosscheck.available(), reason="NGSolve is not installed: pip install organbench[crosscheck]"
)
TIMES, STIFF = (0.5, 1.0), (1e3, 1e4)
PLANE = RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, -0.2 * t))
SPHERE = RigidSphere((3.0, 0.0, 0.2), 2.0, lambda t: (-0.1 * t, 0.0, 0.0))


@pytest.fixture(scope="module")
def ball():
    """A curved ball on its lower cap, which is drawn aside, under a plane and beside a sphere."""
    plain = whole_ball(2)
    mesh = curve(plain, lambda x: x / np.linalg.norm(x, axis=0), lambda x: np.linalg.norm(x, axis=0) > 1 - 1e-9)
    cap = PrescribedDisplacement(facets_where(mesh, lambda x: x[2] < -0.4), motion=lambda t: (0.1 * t, 0.0, 0.0))
    return Problem(mesh, NeoHookean(1.0, 500.0), [cap], [PLANE, SPHERE])


@pytest.fixture(scope="module")
def reference(ball):
    return equilibrium_path(ball, TIMES)[-1]


@pytest.fixture(scope="module")
def soft_and_stiff(ball):
    """The judge with the reference's order and points of contact, by two stiffnesses of contact."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solid, "ORDER", solid.PATH_ORDER)
        patch.setattr(solid, "CONTACT", ball.contact_order)
        return [solid.solve_solid(ball, TIMES, stiff) for stiff in STIFF]


@needs_ngsolve
def test_at_second_order_it_is_the_reference_but_for_how_deep_obstacles_sink_in(reference, soft_and_stiff):
    """0.17 % at the greater stiffness; a tenth of the stiffness is ten times farther off, so nothing else differs."""
    soft, stiff = (np.abs(solution.obstacle_force - reference.obstacle_force).max() for solution in soft_and_stiff)
    assert stiff < 0.003 * np.abs(reference.obstacle_force).max()
    assert soft / stiff == pytest.approx(STIFF[1] / STIFF[0], rel=0.1)


@needs_ngsolve
def test_displacement_is_the_references_at_every_node(ball, reference, soft_and_stiff):
    """Mid-side nodes too, so that points are found in curved elements; a cap's nodes move as the cap does."""
    displacement = soft_and_stiff[1].displacement(nodes(ball.mesh))
    np.testing.assert_allclose(displacement, reference.u, atol=0.005 * np.abs(reference.u).max())
    held = ball.held[0].where(nodes(ball.mesh).T)
    np.testing.assert_allclose(
        displacement[held], np.broadcast_to([0.1, 0.0, 0.0], displacement[held].shape), atol=1e-9
    )


@needs_ngsolve
def test_forces_are_in_balance(soft_and_stiff):
    """The potential and the force of an obstacle have the same points."""
    for solution in soft_and_stiff:
        total = solution.obstacle_force.sum(axis=0) + solution.held_force.sum(axis=0)
        np.testing.assert_allclose(total, 0.0, atol=1e-7 * np.abs(solution.held_force).max())


def pulled_block(cells):
    """A block drawn up and aside, its faces held: singular at their edges."""
    grip = PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9, motion=lambda t: (0.1 * t, 0.0, 0.2 * t))
    foot = PrescribedDisplacement(lambda x: x[2] < 1e-9)
    return Problem(block((cells,) * 3), NeoHookean(1.0, 500.0), [grip, foot])


@needs_ngsolve
def test_third_order_is_nearer_to_a_fine_mesh_than_second_on_the_same():
    """Of a force of 0.62, 0.004 are left at third order, 0.023 at second."""
    fine, second = (equilibrium_path(pulled_block(n), (1.0,))[-1].held_force[0, 2] for n in (5, 2))
    third = solid.solve_solid(pulled_block(2), (1.0,)).held_force[0, 2]
    assert abs(third - fine) < 0.3 * abs(second - fine)
    assert third == pytest.approx(fine, rel=0.01)


@pytest.mark.parametrize(
    "change",
    [
        {"gravity": (0.0, 0.0, -9.81)},
        {"held": []},
        {"held": [PrescribedDisplacement(lambda x: x[2] < -0.4, (2,))]},
        {"obstacles": [RigidCapsule((2.0, 0.0, 0.0), (2.0, 1.0, 0.0), 0.5)]},
        {"obstacles": [replace(PLANE, slip="no_slip")]},
    ],
    ids=["gravity", "free", "one component", "capsule", "no slip"],
)
def test_what_is_not_covered_is_refused(ball, change):
    with pytest.raises(SolveError, match="second judge covers"):
        solid.check_solid(replace(ball, **change))


def test_a_region_without_a_facet_is_refused(ball):
    with pytest.raises(SolveError, match="no whole boundary facet"):
        solid.boundaries(replace(ball, held=[PrescribedDisplacement(lambda x: x[2] < -0.99)]))
