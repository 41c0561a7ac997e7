"""Obstacles that hold what they touch, and capsules: derivatives, bonded limits, letting go."""

import numpy as np
import pytest

from reference_fem import (
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    RigidCapsule,
    RigidPlane,
    RigidSphere,
    equilibrium_path,
)
from reference_fem.contact import augmented as contact
from reference_fem.elements.surface import point_positions
from reference_fem.model.obstacles import gap_into, gaps
from reference_fem.system.saddle_point import System
from reference_fem.system.state import Loads
from tests.reference_fem.bodies import ball_octant, block, contact_potential, symmetry

TISSUE = NeoHookean(1.0, 1000.0)
BOTTOM = PrescribedDisplacement(lambda x: x[2] < 1e-9)
STEP = 1e-6
"""Central differences: truncation about STEP² and round-off about 1e-16 / STEP, both near 1e-10 of the values."""
AGREES = 1e-7
CAPSULE = RigidCapsule((0.2, 0.4, 1.5), (0.7, 0.6, 1.4), 0.35)


def push(t):
    return (0.0, 0.0, -0.2 * min(t, 1.0)) if t <= 1.0 else (0.1 * (t - 1.0), 0.0, -0.2)


def lid(slip, motion=push):
    return RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), motion, slip)


def test_gap_of_a_capsule_beside_and_beyond_its_segment():
    """By hand: radius 0.5 around the x axis from 0 to 2."""
    row = RigidCapsule((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), 0.5).row()
    for point, gap in (((1.0, 0.0, 2.0), 1.5), ((5.0, 0.0, 4.0), 4.5), ((-3.0, 4.0, 0.0), 4.5)):
        n = np.empty(3)
        assert gap_into(row, np.array(point), n, np.empty(3))[0] == pytest.approx(gap, rel=1e-14)
        assert gaps(row, np.array(point)) == pytest.approx(gap, rel=1e-14)


@pytest.mark.parametrize(
    "obstacle", [CAPSULE, RigidSphere((0.4, 0.3, 1.6), 0.5), RigidPlane((0, 0, 2), (0.3, 0.1, -1))]
)
def test_normal_and_curvature_of_the_gap(obstacle):
    row, n, along = obstacle.row(), np.empty(3), np.empty(3)
    for y in np.random.default_rng(2).uniform(-1.0, 1.0, (20, 3)):
        _, curvature = gap_into(row, y, n, along)
        slope = [(gaps(row, y + STEP * e) - gaps(row, y - STEP * e)) / (2 * STEP) for e in np.eye(3)]
        np.testing.assert_allclose(n, slope, atol=AGREES)
        hessian = curvature * (np.eye(3) - np.outer(n, n) - np.outer(along, along))
        turned = []
        for e in np.eye(3):
            ahead, behind = np.empty(3), np.empty(3)
            gap_into(row, y + STEP * e, ahead, along)
            gap_into(row, y - STEP * e, behind, along)
            turned.append((ahead - behind) / (2 * STEP))
        np.testing.assert_allclose(hessian, np.array(turned), atol=AGREES)


@pytest.fixture(scope="module")
def gripped():
    """Three sticking obstacles that press and hold every point, a rough state and a direction."""
    held = [
        RigidPlane((0.0, 0.0, 1.2), (0.1, 0.0, -1.0), slip="no_slip"),
        RigidSphere((1.55, 0.5, 0.5), 0.5, slip="no_slip"),
        RigidCapsule((0.2, -0.8, 0.4), (0.7, -0.8, 0.6), 0.6, slip="no_slip"),
    ]
    system = System(Problem(block(skew=0.1), TISSUE, [BOTTOM], held), NewtonSettings())
    rng = np.random.default_rng(0)
    x, direction = 0.01 * rng.standard_normal(system.total), rng.standard_normal(system.total)
    shape = system.rest().multiplier.shape
    y = point_positions(np.zeros(system.total), system.surface) - system.rows[:, None, None, 1:4]
    grip = contact.Grip(np.ones(shape, dtype=bool), y, rng.standard_normal((*shape, 3)))
    for o, row in enumerate(system.rows):  # a traction lies across the normal at the anchor
        n = np.array([normal(row, row[1:4] + z) for z in y[o].reshape(-1, 3)]).reshape(*shape[1:], 3)
        grip.traction[o] -= np.sum(grip.traction[o] * n, axis=-1, keepdims=True) * n
    return system, x, direction, Loads(0.0, system.rows, 300.0 + rng.uniform(size=shape), grip=grip)


def normal(row, point):
    n = np.empty(3)
    gap_into(row, point, n, np.empty(3))
    return n


def test_force_of_stuck_points_is_the_gradient_of_the_potential(gripped):
    system, x, direction, loads = gripped

    def potential(y):
        touch = contact.touch(loads.rows, np.zeros((3, 3)), loads.multiplier, system.surface.penalty, loads.grip)
        return contact_potential(y, system.surface, touch)

    bare = loads._replace(rows=loads.rows[:0], multiplier=loads.multiplier[:0], grip=contact.NO_GRIP)
    force = system.evaluate(x, loads).residual - system.evaluate(x, bare).residual
    slope = (potential(x + STEP * direction) - potential(x - STEP * direction)) / (2 * STEP)
    assert force @ direction == pytest.approx(slope, rel=AGREES)


def test_tangent_of_stuck_points(gripped):
    system, x, direction, loads = gripped
    evaluation, free = system.evaluate(x, loads), system.pattern.free
    d = direction.copy()
    d[system.pattern.held] = 0.0
    upper = system.pattern.upper(evaluation.values)
    product = upper @ d[free] + upper.T @ d[free] - upper.diagonal() * d[free]
    ahead, behind = (system.evaluate(x + s * d, loads).residual[free] for s in (STEP, -STEP))
    expected = (ahead - behind) / (2 * STEP)
    np.testing.assert_allclose(product, expected, rtol=0.0, atol=AGREES * np.abs(expected).max())


def test_a_plate_without_slip_is_a_bonded_lid():
    """Pressed, then sheared: forces of the same motion prescribed at the top nodes, to the slip that is allowed."""
    plate = Problem(block((3, 3, 3)), TISSUE, [BOTTOM], [lid("no_slip")])
    bonded = Problem(block((3, 3, 3)), TISSUE, [BOTTOM, PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9, motion=push)])
    settings = NewtonSettings(penetration_tol=1e-4)
    for sticking, held in zip(
        equilibrium_path(plate, (0.5, 1.0, 2.0), settings), equilibrium_path(bonded, (0.5, 1.0, 2.0)), strict=True
    ):
        force, expected = sticking.obstacle_force[0], held.held_force[1]
        assert np.abs(force - expected).max() < 2e-3 * np.linalg.norm(expected)
        assert sticking.slippage <= 1e-4 * np.abs(sticking.u).max()
    assert force[0] > 0.03  # the shear that a frictionless plate cannot give


def test_what_is_let_go_is_free_again():
    """Down, sideways and away: the body returns to rest, without a traction left behind."""

    def there_and_back(t):
        return (0.05 * t, 0.0, -0.1 * t) if t <= 1.0 else (0.05, 0.0, -0.1 + 0.3 * (t - 1.0))

    plate = lid("no_slip", there_and_back)
    state = equilibrium_path(Problem(block((2, 2, 2)), TISSUE, [BOTTOM], [plate]), (0.5, 1.0, 1.5, 2.0))[-1]
    assert np.abs(state.obstacle_force).max() == 0.0
    assert np.abs(state.u).max() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(("kappa", "ratio"), [(2.0 / 3.0, np.log(3.0)), (1000.0, 1.0)])
def test_what_no_slip_adds_to_hertz(kappa, ratio):
    """Spence, Proc. R. Soc. A 305, 1968: (1 - nu) log(3 - 4 nu) / (1 - 2 nu), 1.0986 at nu = 0 and 1 at nu = 1/2.

    Within 4 %: four load steps on a coarse mesh, 3 % of the diameter, leave 0.2 to 0.4 %; twelve steps 3 % and 0.5 %.
    A grip that does not hold has 1 for both.
    """
    forces = []
    for slip in ("frictionless", "no_slip"):
        plane = RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, -t), slip)
        problem = Problem(ball_octant(5, grade=0.3), NeoHookean(1.0, kappa), symmetry(), [plane])
        forces.append(equilibrium_path(problem, (0.015, 0.03, 0.045, 0.06))[-1].obstacle_force[0, 2])
    assert forces[1] / forces[0] == pytest.approx(ratio, rel=0.04)


def test_the_end_of_a_capsule_is_a_sphere():
    held = [PrescribedDisplacement(lambda x: np.abs(x[2]) < 1e-9), *symmetry()[:2]]
    probes = (
        RigidSphere((0.0, 0.0, 1.5), 0.5, lambda t: (0.0, 0.0, -t)),
        RigidCapsule((0.0, 0.0, 1.5), (0.0, 0.0, 9.0), 0.5, lambda t: (0.0, 0.0, -t)),
    )
    forces = [
        equilibrium_path(Problem(ball_octant(4), TISSUE, held, [probe]), (0.1,))[0].obstacle_force for probe in probes
    ]
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-5)  # to the Newton tolerance


def test_facets_out_of_reach_change_nothing(monkeypatch):
    """Skipped or not: bitwise the same residual, tangent and force."""
    far = Problem(ball_octant(4), TISSUE, symmetry(), [RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0))])
    system = System(far, NewtonSettings())
    rows = system.rows.copy()
    rows[:, 3] = 0.9
    skipped = system.evaluate(np.zeros(system.total), Loads(0.0, rows, system.rest().multiplier))
    monkeypatch.setattr(contact, "out_of_reach", lambda *_: False)
    touch = contact.touch(rows, np.zeros((1, 3)), system.rest().multiplier, system.surface.penalty)
    every = np.zeros(system.total)
    contact.add_contact.py_func(
        np.zeros(system.total), system.surface, touch, np.zeros(system.pattern.size), every, False
    )
    assert np.array_equal(touch.pressure, skipped.touch.pressure)
    assert (touch.pressure > 0.0).any()
