"""Contact at points inside quadratic facets, smooth and rough."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from massspring import (
    Attachment,
    Body,
    Capsule,
    Clock,
    ImplicitVolume,
    Plane,
    Setup,
    Sphere,
    Trajectory,
    quadratic_body,
    simulate,
    step_limit,
)
from massspring.kernels.points.facets import DEEPER
from massspring.layout.facet_rows import facet_rule
from tests.massspring.conftest import SOFT
from tests.massspring.quadratic import RADIUS, ball_mesh, bricks, quadratic_block

DEPTH = 0.15 * RADIUS
"""What each plane travels."""
PRESSED, HELD = 0.25, 0.75
"""Seconds of pressing, and to the end."""
INSIDE, MOVING = 1e-4, 6e-3
"""Of the radius that nodes or points may be inside: half a second after the press, and while a plane moves by 0.6 radii
a second, as pressures follow a growing load one step late."""
BULGES = 0.012
"""Of the radius that a curved facet bulges into a plane between nodes that touch it."""
CHATTER = 4e-3
"""Of the force at rest, while points at the rim open and close: measured up to 1.9e-3. Which of them do is a matter of
round-off, and so of the processor: depths that differ by 1e-9 give from 1e-5 to 1e-3."""
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
    assert bottom[2] > 0.5 and np.abs(top + bottom).max() < CHATTER * bottom[2]
    assert np.abs(top[:2]).max() < 1e-9 * bottom[2]
    still = np.abs(np.diff(history.contact_force[-5:, 1, 2])).max()
    assert still < CHATTER * bottom[2] and history.kinetic[-1] < 1e-6 * history.elastic[-1]
    for plane in planes:
        assert plane.gap(history.final, HELD).min() > -INSIDE * RADIUS
        assert plane.gap(places(ball(), history.final), HELD).min() > -BULGES * RADIUS
    assert np.abs(history.volume / ball().rest_volumes - 1.0).max() < 1e-5


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
    # Points stick and slip by turns: 24 moments are a sample.
    assert force[20:, 0].mean() == pytest.approx(-FRICTION * force[20:, 2].mean(), rel=5e-2)
    assert force[:, 2].mean() == pytest.approx(slab().mass.sum() * WEAK * np.cos(np.radians(40.0)), rel=0.05)


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


THIN = 0.003
"""Radius of a tool that meets no fixed point of a facet of 20 mm [m]."""


@cache
def pricked(radius: float, friction: float = 0.0, x: float = 0.012):
    """A block of 40 mm, held below, with a sphere that presses 4 mm into the middle of a facet of its top, by `x` = .02
    into the corner between some."""
    body = quadratic_body(*bricks((2, 2, 2), (EDGE, EDGE, EDGE)), SOFT)
    way = Trajectory((0.0, 2.0), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.004)))
    tool = Sphere((x, 0.007 if x < 0.02 else x, EDGE + radius), radius, way, friction)
    held = Attachment(np.flatnonzero(body.rest[:, 2] < 1e-9))
    clock = clock_of(body, 0.5, 2.5, 100, held.nodes)
    setup = Setup(body, ImplicitVolume(), clock, (tool,), (held,), damping=20.0)
    return tool, setup, simulate(setup)


@pytest.mark.parametrize("x", [0.012, 0.02])
def test_a_tool_thinner_than_a_facet_presses_it(x):
    """Its force is that on what is held, its work what the springs and the pressures inside elements store."""
    tool, _, history = pricked(THIN, x=x)
    assert history.outcome == "finished" and not history.inside.any()
    force = history.contact_force[:, 0, 2]
    assert np.abs(history.contact_force[-1, 0] + history.held_force[-1, 0]).max() < 1e-3 * np.abs(force[-1])
    assert history.penetration.max() < 1.05 * DEEPER * THIN
    work = -force @ np.diff(tool.path(np.r_[0.0, history.t])[:, 2]) * -1.0
    assert work == pytest.approx(history.elastic[-1], rel=0.05) and work > 1e-5
    assert (force[10:80] < 0.0).all()  # down, from the first touch on


def test_friction_holds_a_thin_tool_too():
    """A sideways pull below the limit moves the body along, one beyond it slides at Coulomb's force."""
    tool, setup, _ = pricked(THIN, 0.3)
    times, deep = (0.0, 1.0, 2.0), -0.003
    way = Trajectory(times, ((0.0, 0.0, 0.0), (0.0, 0.0, deep), (0.004, 0.0, deep)))
    history = simulate(replace(setup, obstacles=(replace(tool, path=way),)))
    normal, drag = history.contact_force[:, 0, 2], history.contact_force[:, 0, 0]
    share = np.abs(drag / normal)[45:]
    assert (share < 0.9).all() and drag[-1] > 0.05 * abs(normal[-1]) and not history.inside.any()


def test_a_thick_sphere_touches_the_fixed_points_alone():
    """To the bit what it did: no facet gets a further point."""
    _, setup, history = pricked(0.03)
    state = setup.start()
    for frame in range(30):
        state = setup.method.advance(state, setup.boundary(frame))
    assert (state.rows.facets.contact_id > 0).any() and np.ptp(state.rows.facets.count) == 0
    assert history.contact_force[-1, 0, 2] < 0.0
