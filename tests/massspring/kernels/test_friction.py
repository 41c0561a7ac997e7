"""Contact that is rare: rough obstacles, by Coulomb's law, and nodes between two at once."""

import numpy as np
import pytest

from massspring import (
    Attachment,
    Free,
    ImplicitVolume,
    Plane,
    Setup,
    Trajectory,
    simulate,
    tetrahedral_body,
)
from massspring.kernels.contact.modes import ON_EDGE
from tests.massspring.conftest import SOFT, block
from tests.massspring.kernels.test_contact import INSIDE
from tests.massspring.methods.test_methods import clock_for, squeeze


def wedge_of(depth: float, duration: float, angle: float) -> tuple[Plane, Plane]:
    """Two planes that close on a ball of radius 0.05 m from below, their normals `angle` [rad] off the vertical."""
    planes = []
    for side in (-1, 1):
        normal = np.array([side * np.sin(angle), 0.0, np.cos(angle)])
        path = Trajectory((0.0, duration), ((0, 0, 0), tuple(depth * normal)))
        planes.append(Plane(tuple(-0.05 * normal), tuple(normal), path))
    return planes[0], planes[1]


def test_a_body_in_a_wedge_enters_neither_side_and_keeps_its_volume(ball_body):
    """Nodes at the bottom lie on both planes; each plane only pushes, along its own normal."""
    clock = clock_for(ball_body, 60, 20)
    planes = wedge_of(0.03, 0.5 * clock.duration, 0.4)
    held = Attachment(np.flatnonzero(ball_body.rest[:, 2] > 0.04))
    setup = Setup(ball_body, ImplicitVolume(), clock, planes, (held,), damping=40.0)
    state, on_edge = setup.start(), 0
    for frame in range(clock.frames):
        state = setup.method.advance(state, setup.boundary(frame))
        on_edge = max(on_edge, int((state.contacts.mode == ON_EDGE).sum()))
    assert on_edge > 0, "no node came between the planes"
    history = simulate(setup)
    assert history.penetration.max() < INSIDE
    assert np.abs(history.volume / ball_body.volume - 1).max() < 1e-4
    for o, plane in enumerate(planes):
        force = history.contact_force[-1, o]
        assert force @ plane.unit_normal == pytest.approx(np.linalg.norm(force), rel=1e-9) and force[2] > 0
    x, z = history.contact_force[-1].sum(axis=0)[[0, 2]]
    assert np.allclose([x, z], -history.held_force[-1, 0][[0, 2]], atol=0.01 * z)


def test_planes_that_meet_inside_the_body_leave_their_penetration_in_the_record(ball_body):
    """Facing obstacles without room between them: what cannot be met is recorded, and nothing blows up."""
    clock = clock_for(ball_body, 40, 20)
    planes = squeeze(ball_body, 0.5 * float(np.ptp(ball_body.rest[:, 2])) + 0.002, clock.duration)
    history = simulate(Setup(ball_body, Free(), clock, planes, damping=60.0))  # no volume can be kept in no room
    assert history.outcome == "finished"
    assert history.penetration[-1].max() == pytest.approx(0.004, abs=1e-6)  # all of their overlap


def sledge(friction, slope: float, frames: int, damping: float = 0.0):
    """A flat block lying on a plane in gravity that leans by `slope`; how it ends, and the clock."""
    body = tetrahedral_body(*block((3, 3, 1), distortion=0.0), SOFT)
    clock = clock_for(body, frames, 20)
    plane = Plane((0, 0, float(body.rest[:, 2].min())), (0, 0, 1), friction=friction)
    gravity = (slope * 9.81, 0.0, -9.81)
    return body, clock, simulate(Setup(body, ImplicitVolume(), clock, (plane,), (), gravity, damping=damping))


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_block_slides_down_a_slope_by_coulombs_law(friction):
    """Closed form: it gains (slope − mu) g t. The block quivers under its weight: 3 % of that."""
    body, clock, history = sledge(friction, 0.6, 8)
    t = clock.duration
    moved = float((body.mass @ (history.final - body.rest))[0] / body.mass.sum())
    assert moved == pytest.approx(0.5 * (0.6 - friction) * 9.81 * t * t, rel=0.03)
    force = history.contact_force.sum(axis=(0, 1))
    assert -force[0] == pytest.approx(friction * force[2], rel=0.02, abs=1e-12)


@pytest.mark.parametrize("friction", [0.9, "no_slip"])
def test_a_block_rests_on_a_rough_slope(friction):
    """mu > slope: the nodes that carry it stay where they are, and the plane takes the whole weight."""
    body, clock, history = sledge(friction, 0.3, 60, damping=20.0)
    sole = body.rest[:, 2] < body.rest[:, 2].min() + 1e-9
    assert np.abs(history.final - body.rest)[sole].max() < 1e-3  # a twentieth of an edge: it quivers
    assert 0.5 * 0.3 * 9.81 * clock.duration**2 > 0.05  # without friction it would be far away
    assert history.contact_force[-1, 0, 0] == pytest.approx(-0.3 * 9.81 * body.mass.sum(), rel=0.01)
    assert history.contact_force[-1, 0, 2] == pytest.approx(9.81 * body.mass.sum(), rel=0.01)


def test_a_rough_plane_takes_along_what_it_touches(ball_body):
    clock = clock_for(ball_body, 100, 20)
    low, high = ball_body.rest[:, 2].min(), ball_body.rest[:, 2].max()
    keys = (0.0, 0.2 * clock.duration, 0.4 * clock.duration)
    down = Trajectory(keys, ((0, 0, 0), (0, 0, -0.01), (0.004, 0, -0.01)))
    planes = (Plane((0, 0, high), (0, 0, -1), down, "no_slip"), Plane((0, 0, low), (0, 0, 1), friction="no_slip"))
    setup = Setup(ball_body, ImplicitVolume(), clock, planes, damping=40.0)
    history = simulate(setup, snapshots=(30, 100))
    before, after = history.snapshots
    upper = np.flatnonzero(planes[0].gap(before, 30 * clock.frame) < INSIDE)
    lower = np.flatnonzero(planes[1].gap(before, 30 * clock.frame) < INSIDE)
    step = down(100 * clock.frame) - down(30 * clock.frame)
    stuck = [u for u in upper if planes[0].gap(after[u][None], 100 * clock.frame)[0] < INSIDE]
    assert len(stuck) > 3 and np.allclose(after[stuck] - before[stuck], step, atol=1e-9)
    assert len(lower) > 3 and np.abs(after[lower] - before[lower])[:, :2].max() < 1e-9
    assert history.contact_force[30:40, 0, 0].min() > 0  # while the plane moves, it pulls sideways
    assert np.abs(history.volume / ball_body.volume - 1).max() < 1e-4
