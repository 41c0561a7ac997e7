"""Contact at points inside facets: balance, depth, wide contacts, energy, and release."""

from functools import cache

import numpy as np
import pytest

from massspring import (
    Body,
    Clock,
    ImplicitVolume,
    Plane,
    Setup,
    Trajectory,
    quadratic_body,
    simulate,
    step_limit,
)
from massspring.layout.facet_rows import facet_rule
from tests.massspring.conftest import SOFT
from tests.massspring.quadratic import RADIUS, ball_mesh, quadratic_block

DEPTH = 0.15 * RADIUS
"""What each plane travels."""
PRESSED, HELD = 0.25, 0.75
"""Seconds of pressing, and to the end."""
INSIDE, MOVING = 1e-4, 6e-3
"""Of the radius that points may be inside: half a second after the press, and while a plane moves by 0.6 radii a
second, as pressures follow a growing load one step late."""
EDGE = 0.04
"""Of a block [m]."""
FRICTION = 0.5
STEADY = 1e-3
"""Of the force of a wide contact, what it may sway by."""


@cache
def ball() -> Body:
    return quadratic_body(*ball_mesh(), SOFT)


def places(body: Body, x: np.ndarray) -> np.ndarray:
    """Of the contact points [m], (p, 3)."""
    return np.einsum("qa,fai->fqi", facet_rule()[0], x[body.contact_facets]).reshape(-1, 3)


def clock_of(body: Body, fraction: float, duration: float, frames: int, held=()) -> Clock:
    """Frames of equal numbers of steps, each at most `fraction` of the limit."""
    limit = step_limit(body, held_nodes=np.asarray(held, dtype=np.int64)).undamped
    steps = int(np.ceil(duration / frames / (fraction * limit)))
    return Clock(duration / frames, frames, steps)


def planes_at(path: Trajectory, friction=0.0) -> tuple[Plane, Plane]:
    down = Trajectory(path.times, tuple((0.0, 0.0, -z) for _, _, z in path.displacements))
    up, low = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
    return Plane((0, 0, RADIUS), low, down, friction), Plane((0, 0, -RADIUS), up, path, friction)


@cache
def squeezed(fraction: float):
    """A ball pressed by two planes that then stand still."""
    path = Trajectory((0.0, PRESSED), ((0.0, 0.0, 0.0), (0.0, 0.0, DEPTH)))
    clock = clock_of(ball(), fraction, HELD, 60)
    planes = planes_at(path)
    setup = Setup(ball(), ImplicitVolume(), clock, planes, damping=40.0)
    return planes, simulate(setup, snapshots=(15,))


@pytest.mark.parametrize("fraction", [pytest.param(0.1, marks=pytest.mark.slow), 0.25, 0.5, 0.85])
def test_a_squeezed_ball_comes_to_rest_between_equal_forces(fraction):
    """At every share of the stable step."""
    planes, history = squeezed(fraction)
    assert history.outcome == "finished"
    top, bottom = history.contact_force[-1]
    assert bottom[2] > 0.5 and np.abs(top + bottom).max() < 1e-4 * bottom[2]
    assert np.abs(top[:2]).max() < 1e-9 * bottom[2]
    still = np.abs(np.diff(history.contact_force[-5:, 1, 2])).max()
    assert still < 1e-3 * bottom[2] and history.kinetic[-1] < 1e-6 * history.elastic[-1]
    for plane in planes:
        assert plane.gap(places(ball(), history.final), HELD).min() > -INSIDE * RADIUS
    assert np.abs(history.volume / ball().rest_volumes - 1.0).max() < 1e-5


@pytest.mark.parametrize("friction", [0.0, FRICTION])
def test_a_wide_contact_stands_still(friction):
    """A flat block between planes that cover its sides, where volumes undo most of what contact does (eq. 9.6); with
    the part 0.8 of eq. 9.3 the force oscillates by a tenth."""
    body = quadratic_body(*quadratic_block((4, 4, 2), distortion=0.1), SOFT, inertia="stiffness")
    dt = 0.8 * step_limit(body).undamped
    low, high = body.rest[:, 2].min(), body.rest[:, 2].max()
    down = Trajectory((0.0, 800 * dt), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.2 * (high - low))))
    planes = Plane((0, 0, high), (0, 0, -1), down, friction), Plane((0, 0, low), (0, 0, 1), friction=friction)
    history = simulate(Setup(body, ImplicitVolume(), Clock(10 * dt, 150, 10), planes, damping=5.0))
    force = history.contact_force[-20:, 0, 2]
    assert history.outcome == "finished" and force.mean() < -1.0
    assert np.ptp(force) < STEADY * -force.mean()


def growth(left_free: float, theta: float) -> float:
    """Largest growth in a step of eq. 9.6 without elasticity; `left_free`: σ²."""
    sigma = np.sqrt(left_free)

    def step(y: float, v: float, force: float) -> tuple[float, float, float]:
        force = (1.0 - left_free) * force - sigma * v - (1.0 - theta) * sigma * y
        return y + v + sigma * force, v + sigma * force, force

    return float(np.abs(np.linalg.eigvals(np.array([step(*unit) for unit in np.eye(3)]).T)).max())


@pytest.mark.parametrize("left_free", [0.01, 0.05, 0.1])
def test_late_pressures_need_a_part_that_is_left(left_free):
    """Eq. 9.7: the mode grows below θ = 1 − σ² and fades above."""
    assert growth(left_free, 1.0 - 2.0 * left_free) > 1.0 > growth(left_free, 1.0 - 0.5 * left_free)


def test_the_force_does_not_depend_on_the_step():
    forces = [squeezed(fraction)[1].contact_force[-1, 1, 2] for fraction in (0.25, 0.5, 0.85)]
    assert np.ptp(forces) < 3e-3 * forces[0]


@pytest.mark.parametrize("fraction", [0.25, 0.5, 0.85])
def test_a_moving_plane_enters_by_little(fraction):
    """At the end of the press, where the load grows fastest."""
    planes, history = squeezed(fraction)
    deepest = -planes[1].gap(places(ball(), history.snapshots[0]), float(history.t[14])).min()
    assert deepest < MOVING * RADIUS


@pytest.mark.parametrize("fraction", [0.3, 0.6])
def test_contact_and_volumes_add_no_energy(fraction):
    """A ball thrown at a plane comes back no faster than it came, and keeps its volumes."""
    plane, speed = Plane((0.0, 0.0, -1.02 * RADIUS), (0.0, 0.0, 1.0)), 0.15
    velocity = np.zeros_like(ball().rest)
    velocity[:, 2] = -speed
    setup = Setup(ball(), ImplicitVolume(), clock_of(ball(), fraction, 0.4, 80), (plane,), velocity=velocity)
    history = simulate(setup)
    total = history.kinetic + history.elastic
    assert history.outcome == "finished" and history.contact_force[:, 0, 2].max() > 0.0
    assert total.max() < 1.02 * 0.5 * ball().mass.sum() * speed**2


def test_facets_and_nodes_meet_in_the_same_force():
    """Two ways to touch, one body: the nodes' force is coarser."""
    by_nodes = quadratic_body(*ball_mesh(), SOFT, contact="nodes")
    path = Trajectory((0.0, PRESSED), ((0.0, 0.0, 0.0), (0.0, 0.0, DEPTH)))
    clock = clock_of(by_nodes, 0.5, HELD, 60)
    history = simulate(Setup(by_nodes, ImplicitVolume(), clock, planes_at(path), damping=40.0))
    force = squeezed(0.5)[1].contact_force[-1, 1, 2]
    assert history.contact_force[-1, 1, 2] == pytest.approx(force, rel=0.15)
    assert not len(by_nodes.contact_facets)


@pytest.mark.parametrize("contact", ["facets", "nodes"])
def test_a_block_between_smooth_planes_is_compressed_uniformly(contact):
    """mu A (1/s² − s) at rest, s = 0.85: a deformation that the elements represent exactly."""
    body = quadratic_body(*quadratic_block((2, 2, 1), 0.5 * EDGE, 0.0), SOFT, contact=contact)
    height, shorter = 0.5 * EDGE, 0.85
    down = Trajectory((0.0, PRESSED), ((0.0, 0.0, 0.0), (0.0, 0.0, (shorter - 1.0) * height)))
    planes = Plane((0, 0, height), (0, 0, -1), down), Plane((0, 0, 0), (0, 0, 1))
    clock = clock_of(body, 0.5, 2.0 * HELD, 40)
    history = simulate(Setup(body, ImplicitVolume(), clock, planes, damping=40.0))
    expected = SOFT.shear_modulus * EDGE**2 * (shorter**-2 - shorter)
    assert history.contact_force[-1, 1, 2] == pytest.approx(expected, rel=5e-3)
    wide = np.ptp(history.final[:, 0]) / EDGE
    assert wide == pytest.approx(shorter**-0.5, rel=2e-3)


def test_a_plane_that_leaves_lets_go():
    """No force is left behind: neither pressure nor friction pulls."""
    times = (0.0, 0.1, 0.15, 0.3)
    path = Trajectory(times, tuple((0.0, 0.0, z) for z in (0.0, DEPTH, -0.5 * DEPTH, -0.5 * DEPTH)))
    clock = clock_of(ball(), 0.5, times[-1], 30)
    history = simulate(Setup(ball(), ImplicitVolume(), clock, planes_at(path, 0.4), damping=40.0))
    assert (history.contact_force[:, 1, 2] >= 0.0).all() and (history.contact_force[:, 0, 2] <= 0.0).all()
    assert history.contact_force[5, 1, 2] > 0.1 and not history.contact_force[-5:].any()
