"""Obstacles and attachments in a run: nothing inside, forces in balance, Coulomb's law, nodes between two obstacles."""

import numpy as np
import pytest

from massspring import (
    Attachment,
    Capsule,
    Free,
    ImplicitVolume,
    Plane,
    Setup,
    Sphere,
    Trajectory,
    simulate,
    tetrahedral_body,
)
from massspring.kernels.contact.node_contact import ON_EDGE
from tests.massspring.conftest import SOFT, block
from tests.massspring.methods.test_methods import clock_for, squeeze

INSIDE = 1e-12  # m: round-off of positions of some centimetres
SUNK = 1e-7  # of a sphere's radius: what the last change of pressure moves a node along the sphere, squared


@pytest.mark.parametrize("method", [Free(), ImplicitVolume()], ids=["free", "implicit_volume"])
def test_no_node_is_left_inside_a_sphere(ball_body, method):
    clock = clock_for(ball_body, 30, 10)
    sphere = Sphere((0.0, 0.0, 0.0702), 0.02, Trajectory((0.0, clock.duration), ((0, 0, 0), (0, 0, -0.015))))
    held = Attachment(np.flatnonzero(ball_body.rest[:, 2] < -0.04))
    setup = Setup(ball_body, method, clock, (sphere,), (held,), damping=30.0)
    history = simulate(setup, snapshots=range(1, 31))
    touched = False
    for frame, x in zip(history.snapshot_frames, history.snapshots, strict=True):
        gap = sphere.gap(x[ball_body.surface_nodes], frame * clock.frame).min()
        assert gap > -SUNK * sphere.radius
        touched |= gap < INSIDE
    assert touched, "the probe never reached the body"


@pytest.mark.parametrize("method", [Free(), ImplicitVolume()], ids=["free", "implicit_volume"])
def test_forces_balance_at_rest(block_body, method):
    """What the sphere gives, the attachment takes: contact + reaction + weight = 0 once all is still."""
    clock = clock_for(block_body, 200, 20)
    top = block_body.rest[:, 2].max()
    press = Trajectory((0.0, 0.2 * clock.duration), ((0, 0, 0), (0, 0, -0.02)))
    sphere = Sphere((0.03, 0.025, top + 0.04), 0.03, press)
    held = Attachment(np.flatnonzero(block_body.rest[:, 2] < 0.005))
    gravity = (0.3, 0.0, -1.0)
    setup = Setup(block_body, method, clock, (sphere,), (held,), gravity, damping=60.0)
    history = simulate(setup)
    contact, reaction = history.contact_force[-1, 0], history.held_force[-1, 0]
    weight = block_body.mass.sum() * np.array(gravity)
    assert contact[2] < -1e-3
    assert np.abs(contact + reaction + weight).max() < 1e-3 * np.abs(contact).max()


def test_clamps_lose_no_volume_when_contact_is_inside_the_multiplier(block_body):
    """Contact after the correction would lose 0.05 to 0.64 % (theory); inside it loses one step's square."""
    clock = clock_for(block_body, 300, 20)
    planes = squeeze(block_body, 0.004, 0.2 * clock.duration)
    history = simulate(Setup(block_body, ImplicitVolume(), clock, planes, damping=60.0))
    assert np.abs(history.contact_force[-1, :, 2]).min() > 0
    assert abs(history.volume[-1, 0] / block_body.volume - 1) < 1e-9


def test_held_nodes_follow_their_path_exactly(ball_body):
    clock = clock_for(ball_body, 20, 10)
    nodes = np.flatnonzero(ball_body.rest[:, 2] > 0.04)
    path = Trajectory((0.0, 0.5 * clock.duration, clock.duration), ((0, 0, 0), (0.004, 0, -0.006), (0, 0.001, 0)))
    setup = Setup(ball_body, ImplicitVolume(), clock, attachments=(Attachment(nodes, path),), damping=30.0)
    history = simulate(setup, snapshots=range(1, 21))
    for frame, x in zip(history.snapshot_frames, history.snapshots, strict=True):
        assert np.allclose(x[nodes] - ball_body.rest[nodes], path(frame * clock.frame), atol=1e-12)


def test_the_distance_to_a_capsule_is_that_to_the_nearest_of_many_spheres():
    """Outside truth: 2,001 spheres along the axis; the nearest is off by half a spacing's square over twice the gap."""
    capsule = Capsule((0.0, 0.01, 0.0), (0.05, -0.02, 0.03), 0.004, Trajectory((0.0, 1.0), ((0, 0, 0), (0.01, 0, 0))))
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (50, 3))
    axis = capsule.anchor + np.linspace(0, 1, 2001)[:, None] * capsule.span + [0.005, 0, 0]
    nearest = np.linalg.norm(points[:, None] - axis[None], axis=2).min(axis=1) - 0.004
    assert np.allclose(capsule.gap(points, 0.5), nearest, atol=1e-6)


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
