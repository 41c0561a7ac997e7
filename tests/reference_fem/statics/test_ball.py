"""Contact: an eighth of a ball between planes against the converged table, and a spherical probe."""

import numpy as np
import pytest

from reference_fem import (
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    RigidPlane,
    RigidSphere,
    equilibrium_path,
    exact,
    nodes,
)
from tests.reference_fem.bodies import ball_octant, symmetry


def squeeze(n, times, penetration_tol=1e-3, kappa=5000.0, **settings):
    mesh = ball_octant(n)
    plane = RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, -t))
    problem = Problem(mesh, NeoHookean(1.0, kappa), symmetry(), [plane])
    return mesh, equilibrium_path(problem, times, NewtonSettings(penetration_tol=penetration_tol, **settings))


@pytest.fixture(scope="module")
def squeezed():
    return squeeze(10, (0.05, 0.10, 0.15, 0.20, 0.25, 0.30))


@pytest.mark.parametrize("share", [0.10, 0.20, 0.30])
def test_force_and_equator_of_a_squeezed_ball(squeezed, share):
    """Within 1 %: 1,000 elements leave 0.5 %, an off-by-one in the contact weights would be far more."""
    (mesh, path), x = squeezed, nodes(squeezed[0])
    state = next(s for s in path if s.t == share)
    equator = (nodes(mesh) + state.u)[np.argmax(x[:, 0]), 0]
    assert equator == pytest.approx(exact.BALL_BETWEEN_PLANES[share][1], rel=1e-3)
    assert -4.0 * state.obstacle_force[0, 2] == pytest.approx(exact.BALL_BETWEEN_PLANES[share][0], rel=0.01)


def test_a_squeezed_ball_keeps_its_volume_and_stays_out_of_the_plane(squeezed):
    for state in squeezed[1]:
        assert abs(state.volume / state.volume0 - 1.0) < 5e-4
        assert state.min_J > 0.5
        assert state.penetration <= 1e-3 * state.t


def test_forces_balance(squeezed):
    """Bottom plane of symmetry against obstacle: equilibrium to the force tolerance, 1e-6."""
    for state in squeezed[1]:
        force = state.obstacle_force.sum(axis=0) + state.held_force.sum(axis=0)
        assert np.abs(force).max() < 3e-6 * np.abs(state.obstacle_force).max()
        np.testing.assert_allclose(state.reaction.sum(axis=0), state.held_force.sum(axis=0), atol=1e-12)


def test_a_softer_bulk_is_noticed():
    """The volume test would catch kappa entering with a wrong power: at kappa = 10 mu the volume goes."""
    _, path = squeeze(4, (0.1, 0.2), kappa=10.0)
    assert path[-1].volume / path[-1].volume0 - 1.0 < -5e-4


def test_without_multiplier_updates_a_soft_penalty_sinks_in():
    _, path = squeeze(5, (0.1, 0.2), penetration_tol=1.0, penalty=30.0)
    assert path[-1].penetration > 1e-3 * path[-1].t
    _, path = squeeze(5, (0.1, 0.2), penalty=30.0)
    assert path[-1].penetration <= 1e-3 * path[-1].t


@pytest.fixture(scope="module")
def probed():
    """A ball of a third of the body's radius pushed in along the axis, the equator glued."""
    held = [PrescribedDisplacement(lambda x: np.abs(x[2]) < 1e-9), *symmetry()[:2]]
    probe = RigidSphere((0.0, 0.0, 1.35), 0.35, lambda t: (0.0, 0.0, -t))
    mesh = ball_octant(6)
    return mesh, probe, equilibrium_path(Problem(mesh, NeoHookean(1.0, 1000.0), held, [probe]), (0.1, 0.2))


def test_a_probe_is_carried_by_the_holders(probed):
    for state in probed[2]:
        balance = state.obstacle_force.sum(axis=0) + state.held_force.sum(axis=0)
        assert np.abs(balance).max() < 3e-6 * np.abs(state.obstacle_force).max()
        assert state.obstacle_force[0, 2] < 0.0


def test_a_turned_scene_gives_the_turned_answer():
    """To the Newton tolerance: the unknowns come in another order, so round-off differs."""
    mesh = ball_octant(4)
    held = [PrescribedDisplacement(lambda x: np.abs(x[2]) < 1e-9), *symmetry()[:2]]
    probe = RigidSphere((0.0, 0.0, 1.5), 0.5, lambda t: (0.0, 0.0, -t))
    straight = equilibrium_path(Problem(mesh, NeoHookean(1.0, 1000.0), held, [probe]), (0.1,))[0]
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    turned_mesh = type(mesh)(turn @ mesh.doflocs, mesh.t)
    turned_held = [PrescribedDisplacement(lambda x: np.abs(x[0]) < 1e-9), *symmetry()[1:]]
    turned_probe = RigidSphere(tuple(turn @ (0.0, 0.0, 1.5)), 0.5, lambda t: turn @ (0.0, 0.0, -t))
    turned = equilibrium_path(Problem(turned_mesh, NeoHookean(1.0, 1000.0), turned_held, [turned_probe]), (0.1,))[0]
    np.testing.assert_allclose(turned.u, straight.u @ turn.T, atol=1e-6)
    np.testing.assert_allclose(turned.obstacle_force, straight.obstacle_force @ turn.T, atol=1e-5)
