"""Friction at points inside facets: sliding and resting blocks, round obstacles."""

from functools import cache

import numpy as np
import pytest

from massspring import (
    Attachment,
    Body,
    Capsule,
    ImplicitVolume,
    Plane,
    Setup,
    Sphere,
    Trajectory,
    quadratic_body,
    simulate,
)
from tests.massspring.conftest import SOFT
from tests.massspring.contact.test_facet_contact import EDGE, FRICTION, HELD, INSIDE, PRESSED, ball, clock_of, places
from tests.massspring.quadratic import RADIUS, quadratic_block

CREEP = 5e-5
"""Of the block in 0.6 s [m]: points that lose the plane and touch it again stick at a new place."""


WEAK = 2.0
"""Gravity [m/s²]: a soft block keeps its shape."""


@cache
def slab() -> Body:
    """A block whose sides are flat."""
    return quadratic_body(*quadratic_block((2, 2, 1), 0.5 * EDGE, 0.0), SOFT)


def slid(angle: float, friction, duration: float = 0.4, fraction: float = 0.5):
    """A block on a plane, gravity at `angle` [degrees] to its normal; positions after settling are kept."""
    body, tilt = slab(), np.radians(angle)
    floor = Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), friction=friction)
    clock = clock_of(body, fraction, duration, 40)
    gravity = (WEAK * float(np.sin(tilt)), 0.0, -WEAK * float(np.cos(tilt)))
    damping = 25.0 if friction == "no_slip" or np.tan(tilt) < friction else 0.0
    setup = Setup(body, ImplicitVolume(), clock, (floor,), gravity=gravity, damping=damping)
    return simulate(setup, snapshots=(20, 40)), clock


def mean_motion(history, before: int, after: int) -> np.ndarray:
    mass = slab().mass
    return mass @ (history.snapshots[after] - history.snapshots[before]) / mass.sum()


def test_a_block_slides_above_the_angle_of_friction():
    """g (sin − mu cos): twice the distance between the middle and the end of the run."""
    history, clock = slid(40.0, FRICTION)
    half = 0.5 * clock.duration
    expected = WEAK * (np.sin(np.radians(40.0)) - FRICTION * np.cos(np.radians(40.0)))
    moved = slab().mass @ (history.final - slab().rest) / slab().mass.sum()
    assert history.outcome == "finished" and moved[0] == pytest.approx(0.5 * expected * (2 * half) ** 2, rel=0.05)
    force = history.contact_force[:, 0]
    assert (np.linalg.norm(force[:, :2], axis=1) <= FRICTION * force[:, 2] * (1 + 1e-9)).all()
    assert force[20:, 0].mean() == pytest.approx(-FRICTION * force[20:, 2].mean(), rel=1e-2)
    assert force[:, 2].mean() == pytest.approx(slab().mass.sum() * WEAK * np.cos(np.radians(40.0)), rel=0.03)


@pytest.mark.parametrize(
    ("angle", "friction"), [pytest.param(20.0, FRICTION, id="Coulomb"), pytest.param(30.0, "no_slip", id="no slip")]
)
def test_a_block_rests_below_the_angle_and_without_slip(angle, friction):
    """The force along the plane is the weight's part, and nothing creeps. Gravity begins at once: there is a first slip
    while the pressure builds up, which only the plane without slip takes back."""
    history, _ = slid(angle, friction, 1.2)
    weight = WEAK * slab().mass.sum()
    force = history.contact_force[-10:, 0].mean(axis=0)  # without slip points come and go: that of one frame scatters
    tilt = np.radians(angle)
    assert np.allclose(force, weight * np.array([-np.sin(tilt), 0.0, np.cos(tilt)]), atol=3e-3 * weight)
    low = places(slab(), slab().rest)[:, 2] < 1e-9
    first, middle, end = (places(slab(), x)[low, :2].mean(axis=0) for x in (slab().rest, *history.snapshots))
    assert np.abs(end - middle).max() < CREEP and np.abs(mean_motion(history, 0, 1)).max() < CREEP
    if friction == "no_slip":
        assert np.abs(end - first).max() < 0.25 * np.abs(history.final - slab().rest).max()


@pytest.mark.parametrize("friction", [0.0, 0.3, "no_slip"])
@pytest.mark.parametrize("shape", ["sphere", "capsule"])
def test_a_round_obstacle_presses_a_held_ball(shape, friction):
    """Contact and attachment together: their forces sum to nothing, and the obstacle stays outside."""
    radius, way = 0.4 * RADIUS, 0.12 * RADIUS
    path = Trajectory((0.0, PRESSED), ((0.0, 0.0, 0.0), (0.0, 0.0, -way)))
    centre = (0.0, 0.0, RADIUS + radius)
    if shape == "sphere":
        obstacle = Sphere(centre, radius, path, friction)
    else:
        obstacle = Capsule((-RADIUS, 0.0, centre[2]), (RADIUS, 0.0, centre[2]), radius, path, friction)
    held = Attachment(np.flatnonzero(ball().rest[:, 2] < -0.7 * RADIUS))
    clock = clock_of(ball(), 0.5, HELD, 40, held.nodes)
    history = simulate(Setup(ball(), ImplicitVolume(), clock, (obstacle,), (held,), damping=40.0))
    assert history.outcome == "finished"
    push, hold = history.contact_force[-1, 0], history.held_force[-1, 0]
    assert push[2] < -0.05 and np.abs(push + hold).max() < 2e-3 * abs(push[2])
    assert obstacle.gap(places(ball(), history.final), HELD).min() > -INSIDE * RADIUS
    assert np.abs(history.volume / ball().rest_volumes - 1.0).max() < 1e-5
