"""Angular springs: the contract of methods, forces of their energy, what they resist and what they cannot tell."""

import numpy as np
import pytest

from massspring import AngularSprings, Setup, simulate
from massspring.methods.literature.angular_springs import Angles, angle_forces_into, angles_of, opening
from tests.massspring.methods.families.test_points import CONTRACT
from tests.massspring.methods.test_methods import clock_for
from tests.massspring.methods.test_tetrahedra import rest_forces


@pytest.fixture(params=["block", "ball"])
def body(request):
    return request.getfixturevalue(f"{request.param}_body")


@pytest.mark.parametrize("promise", CONTRACT, ids=lambda promise: promise.__name__.removeprefix("test_"))
def test_the_contract_of_methods_holds(promise, block_body):
    promise(block_body, AngularSprings())


def shaken(body, size=0.1):
    return body.rest + size * 0.02 * np.random.default_rng(5).uniform(-1, 1, body.rest.shape)


def angle_energy(x, angles):
    """Σ ½ κ (θ − θ0)² [J] (eq. 14.5)."""
    now = np.array([opening(x, *corner)[0] for corner in angles.corner])
    return 0.5 * angles.stiffness @ (now - angles.rest) ** 2


def test_forces_are_the_slope_of_the_energy(body):
    angles, x, step = angles_of(body, 1.0), shaken(body), 1e-7
    force = np.empty_like(x)
    angle_forces_into(x, angles, force)
    slope = np.empty_like(x)
    for i, axis in np.ndindex(*x.shape):
        ends = []
        for sign in (1, -1):
            moved = x.copy()
            moved[i, axis] += sign * step
            ends.append(angle_energy(moved, angles))
        slope[i, axis] = (ends[0] - ends[1]) / (2 * step)
    assert np.abs(force).max() > 0.01 and np.abs(force + slope).max() < 1e-6 * np.abs(force).max()


def test_the_stiffness_it_names_is_the_derivative_of_its_forces(body):
    method = AngularSprings(2.0)
    factor = method.added_stiffness(body)
    direction = np.random.default_rng(1).uniform(-1, 1, body.rest.shape)
    step = 1e-7 * body.size
    after, before = (rest_forces(method, body, body.rest + s * direction) for s in (step, -step))
    exact = -(factor @ (factor.T @ direction.ravel())).reshape(-1, 3)
    assert np.abs((after - before) / (2 * step) - exact).max() < 1e-4 * np.abs(exact).max()


@pytest.mark.parametrize(("fraction", "stays"), [(0.9, True), (1.15, False)])
def test_the_limit_counts_the_angles(body, fraction, stays):
    """With ten times the default the angles alone set the limit."""
    method = AngularSprings(10.0)
    clock = clock_for(body, 20, 100, fraction, method)
    assert clock.dt < 0.8 * clock_for(body, 1, 1, fraction).dt
    v = 1e-6 * np.random.default_rng(0).normal(size=body.rest.shape)
    history = simulate(Setup(body, method, clock, velocity=v))
    grown = history.outcome != "finished" or history.kinetic[-1] > 1e3 * 0.5 * body.mass @ (v * v).sum(axis=1)
    assert grown != stays


def test_edges_are_paired_with_the_opposite_ones(ball_body):
    angles = angles_of(ball_body, 1.0)
    assert np.degrees(angles.rest).min() > 100.0  # about 160 between opposite edges of a ball of 162 nodes
    assert len({tuple(corner) for corner in angles.corner.tolist()}) == len(angles.corner)
    surface = len(ball_body.surface_nodes)
    assert set(angles.corner[:, 1]) == set(ball_body.surface_nodes) and 3 * surface <= len(angles.rest) <= 6 * surface


def test_a_bulge_and_a_dent_are_the_same_angle():
    angles = Angles(np.array([[0, 1, 2]]), np.array([2.5]), np.array([1.0]))
    x = np.array([[-1.0, 0.0, 0.0], [0.0, 0.3, 0.0], [1.0, 0.0, 0.0]])
    assert angle_energy(x, angles) == angle_energy(x * [1, -1, 1], angles) > 0.0
    force = np.ones_like(x)
    angle_forces_into(x * [1, 0, 1], angles, force)
    assert not force.any()  # straight: the force has no direction
