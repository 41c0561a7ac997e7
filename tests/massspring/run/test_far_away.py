"""Single precision far from the origin: positions are kept relative to the body, so that it costs no digit."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import (
    Attachment,
    Body,
    Free,
    ImplicitVolume,
    Plane,
    Probe,
    Setup,
    Sphere,
    Trajectory,
    Volumes,
    simulate,
)
from tests.massspring.methods.test_methods import clock_for, squeeze

FAR = np.array([10.0, -8.0, 6.0])
"""[m]; single precision has 1e-6 m there."""
METHODS = (Free(), ImplicitVolume())


def pressed(body: Body, method, precision: str, shift: np.ndarray) -> Setup:
    """All that has a place: two planes, a rough sphere that comes in, held nodes that are drawn aside, and a start away
    from rest."""
    clock = clock_for(body, 20, 20)
    depth, size = 0.05 * float(np.ptp(body.rest[:, 2])), float(np.ptp(body.rest[:, 0]))
    middle = body.rest.mean(axis=0)
    centre = np.array([body.rest[:, 0].max() + 0.5 * size, middle[1], middle[2]])
    still, inwards = (0.0, 0.0, 0.0), (-0.1 * size, 0.0, 0.0)
    ball = Sphere(tuple(centre + shift), 0.5 * size, Trajectory((0.0, clock.duration), (still, inwards)), 0.3)
    aside = Trajectory((0.0, clock.duration), (still, (0.0, 0.02 * size, 0.0)))
    held = Attachment(np.flatnonzero(body.rest[:, 0] < body.rest[:, 0].min() + 0.1 * size), aside)
    there = replace(body, rest=body.rest + shift)
    wide = middle + 0.99 * (body.rest - middle) + shift
    planes = squeeze(there, depth, 0.5 * clock.duration)
    return Setup(there, method, clock, (*planes, ball), (held,), damping=40.0, positions=wide, precision=precision)  # pyright: ignore[reportArgumentType]


def errors(body: Body, method, shift: np.ndarray) -> np.ndarray:
    """Of single precision against double, at the end of the run: positions over size, forces over the largest."""
    single, double = (simulate(pressed(body, method, precision, shift)) for precision in ("float32", "float64"))
    assert single.good_frames == double.good_frames == len(double.t)
    force = np.abs(double.contact_force).max()
    assert (np.abs(double.contact_force[-1]).max(axis=1) > 0).all(), "an obstacle touches nothing"
    x = np.abs(single.final - double.final).max() / body.size
    return np.array([x, np.abs(single.contact_force - double.contact_force)[-1].max() / force])


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_single_precision_at_ten_metres_is_as_good_as_at_the_origin(ball_body, method):
    """Kept as given, positions would be wrong by 2e-5 of the body's size as soon as they are stored."""
    here, there = errors(ball_body, method, np.zeros(3)), errors(ball_body, method, FAR)
    assert (here > 1e-12).all(), "both ran in double precision"
    assert (there < 5.0 * here).all() and there[0] < 3e-6


def test_many_volumes_are_met_at_ten_metres(filled_ball):
    body = filled_ball.keeping(Volumes.nodal(filled_ball))
    assert (errors(body, ImplicitVolume(), FAR) < [5e-6, 1e-5]).all()


def test_a_state_is_relative_to_the_middle_of_the_body_at_the_start(ball_body):
    setup = pressed(ball_body, ImplicitVolume(), "float32", FAR)
    state, positions = setup.start(), setup.positions
    assert positions is not None and np.abs(state.nodes.x).max() < 0.51 * np.ptp(positions, axis=0).max()
    assert np.abs(state.x - positions).max() < 1e-8
    back = state.moved_to(positions + 0.01)
    assert np.abs(back.x - positions - 0.01).max() < 1e-8


def test_the_tip_of_a_probe_is_where_it_is_in_double_precision(ball_body):
    """Relative to the body, as all obstacles are."""
    far = replace(ball_body, rest=ball_body.rest + FAR)
    probe = Probe(tuple(FAR + 0.1), 0.0, Trajectory((0.0, 1.0), ((0, 0, 0), (0, 0, -0.1))))
    double = Setup(far, ImplicitVolume(), clock_for(far, 2, 3), (probe,))
    single = replace(double, precision="float32")
    for mine, theirs in zip(single.boundary(1).tips, double.boundary(1).tips, strict=True):
        assert np.abs(mine + single.origin - theirs).max() < 1e-14 and np.abs(mine).max() < 0.2


def test_double_precision_is_as_given(ball_body):
    setup = pressed(ball_body, ImplicitVolume(), "float64", FAR)
    plane = setup.obstacles[0]
    assert isinstance(plane, Plane) and setup.start().origin is None and not setup.origin.any()
    assert np.array_equal(setup.boundary(0).position[0, 0], plane.anchor + plane.path(setup.clock.dt))
