"""Angular springs: the contract of methods, forces of their energy, what they resist and what they cannot tell."""

import numpy as np
import pytest

from massspring import AngularSprings, Clock, Free, MassSpringError, Ramp, Setup, membrane_body, simulate
from massspring.methods.literature.angular_springs import Angles, angle_forces_into, angles_of, opening
from tests.massspring.conftest import SOFT, icosphere
from tests.massspring.methods.test_cells import rest_forces
from tests.massspring.methods.test_methods import clock_for, squeeze
from tests.massspring.methods.test_quadratic_motion import CONTRACT


@pytest.fixture(params=["block", "ball"])
def body(request):
    return request.getfixturevalue(f"{request.param}_body")


@pytest.mark.parametrize("promise", CONTRACT, ids=lambda promise: promise.__name__.removeprefix("test_"))
def test_the_contract_of_methods_holds(promise, block_body):
    promise(block_body, AngularSprings())


@pytest.mark.parametrize("promise", [p for p in CONTRACT if "turning" not in p.__name__], ids=lambda p: p.__name__[5:])
def test_and_on_a_surface(promise, ball_body):
    """But for a press that turns with the scene: a pole pressed flat has straight angles, whose force round-off
    turns."""
    promise(ball_body, AngularSprings())


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


def test_they_give_no_force_and_no_moment_in_sum(body):
    angles, x = angles_of(body, 1.0), shaken(body)
    force = np.empty_like(x)
    angle_forces_into(x, angles, force)
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * np.abs(force).sum()
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-13 * np.abs(force).sum()


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


def test_they_stiffen_a_press_and_keep_no_volume(filled_ball):
    """Pressed by a quarter of its radius on both sides."""
    planes = squeeze(filled_ball, 0.012, 0.5)

    def pressed(method):
        clock = clock_for(filled_ball, 1, 1, method=method)
        frames = round(0.8 / clock.dt / 20)
        history = simulate(Setup(filled_ball, method, Clock(20 * clock.dt, frames, 20), planes, damping=20.0))
        return history.contact_force[-1, 1, 2], 1.0 - history.volume[-1, 0] / filled_ball.volume

    (soft, free), (stiff, lost) = pressed(Free()), pressed(AngularSprings())
    assert stiff > 1.1 * soft > 0.0 and lost > 0.9 * free > 0.03


def test_what_is_none_is_refused(filled_ball):
    with pytest.raises(MassSpringError, match="must be positive and finite"):
        AngularSprings(0.0)
    with pytest.raises(MassSpringError, match="could be filled"):
        Setup(filled_ball, AngularSprings(), Clock(0.01, 1, 1), targets={"body": Ramp((0.0, 1.0), (1.0, 1.1))})
    wall = membrane_body(*icosphere(1), 0.003, SOFT)  # without a spring between two nodes there is no stiffness to take
    with pytest.raises(MassSpringError, match="its angles are as stiff as springs between two nodes"):
        Setup(wall, AngularSprings(), Clock(0.01, 1, 1))
