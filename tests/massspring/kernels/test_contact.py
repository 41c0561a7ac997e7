"""Obstacles and attachments: nothing inside, forces in balance, volume kept under clamps."""

import numpy as np
import pytest

from massspring import (
    Attachment,
    Capsule,
    Clock,
    Free,
    ImplicitVolume,
    MassSpringError,
    Plane,
    Setup,
    Sphere,
    Trajectory,
    simulate,
    step_limit,
    tetrahedral_body,
)
from massspring.kernels.arrays.layout import Push
from massspring.kernels.contact.active_set import find_contacts, pressure_reach, revise_contacts
from tests.massspring.conftest import SOFT, block
from tests.massspring.methods.test_methods import clock_for, squeeze

INSIDE = 1e-12  # m: round-off of positions of some centimetres
SUNK = 1e-7  # of a sphere's radius: what the last change of pressure moves a node along the sphere, squared


@pytest.mark.parametrize("method", [Free(), ImplicitVolume()], ids=["free", "implicit_volume"])
def test_no_node_is_left_inside_a_plane(ball_body, method):
    clock = clock_for(ball_body, 30, 10)
    planes = squeeze(ball_body, 0.012, 0.9 * clock.duration)
    history = simulate(Setup(ball_body, method, clock, planes, damping=30.0), snapshots=range(1, 31))
    for frame, x in zip(history.snapshot_frames, history.snapshots, strict=True):
        for plane in planes:
            surface = x[ball_body.surface_nodes]
            assert plane.gap(surface, frame * clock.frame).min() > -INSIDE


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
def test_a_deep_probe_comes_to_rest(method):
    """Nodes that slide on a small sphere under pressure lose their energy, at half the stability limit too.

    Pushing along the predicted normal instead of the present one pumps it up: kinetic over elastic energy grows from
    2e-3 to 2e-2 (free) while the probe rests; here it falls below 1e-6.
    """
    points, faces, tetrahedra = block((6, 6, 3), edge=0.01)
    body, damping = tetrahedral_body(points, faces, tetrahedra, SOFT), 15.0
    held = np.flatnonzero(points[:, 2] < 0.003)
    frame = 10 * step_limit(body, damping, held).damped
    clock = Clock(frame, round(1.5 / frame), 20)
    start, down = (0.031, 0.029, float(points[:, 2].max()) + 0.0081), (0.0, 0.0, -0.012)
    probe = Sphere(start, 0.008, Trajectory((0.0, 0.9), ((0, 0, 0), down)))
    history = simulate(Setup(body, method, clock, (probe,), (Attachment(held),), damping=damping))
    share = history.kinetic / np.maximum(history.elastic, history.elastic[-1] * 1e-3)
    assert np.linalg.norm(history.contact_force[-1, 0]) > 0.1 * SOFT.shear_modulus * probe.radius**2
    # Two thirds of a second of damping at 15/s take four decades off; two are asked for.
    assert share[-1] < 1e-5
    assert share[-1] < 1e-2 * share[round(0.7 * clock.frames)]


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


def test_an_obstacle_only_pushes(ball_body):
    clock = clock_for(ball_body, 40, 10)
    planes = squeeze(ball_body, 0.01, 0.5 * clock.duration)
    history = simulate(Setup(ball_body, ImplicitVolume(), clock, planes, damping=30.0))
    assert (history.contact_force[:, 0, 2] <= 0).all() and (history.contact_force[:, 1, 2] >= 0).all()


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


@pytest.mark.parametrize("method", [Free(), ImplicitVolume()], ids=["free", "implicit_volume"])
@pytest.mark.parametrize("direction", [(0.0, 1.0, 0.0), (0.3, 0.2, 1.0)], ids=["lying", "tip first"])
def test_no_node_is_left_inside_a_capsule(ball_body, method, direction):
    clock = clock_for(ball_body, 30, 10)
    axis = 0.06 * np.array(direction) / np.linalg.norm(direction)
    start = np.array([0.001, 0.0, 0.0612]) - (0.5 * axis if direction[2] == 0 else 0)
    capsule = Capsule(
        tuple(start), tuple(start + axis), 0.01, Trajectory((0.0, clock.duration), ((0, 0, 0), (0, 0, -0.02)))
    )
    held = Attachment(np.flatnonzero(ball_body.rest[:, 2] < -0.04))
    history = simulate(Setup(ball_body, method, clock, (capsule,), (held,), damping=30.0), snapshots=range(1, 31))
    for frame, x in zip(history.snapshot_frames, history.snapshots, strict=True):
        gap = capsule.gap(x[ball_body.surface_nodes], frame * clock.frame).min()
        assert gap > -100 * SUNK * capsule.radius
    assert history.contact_force[-1, 0, 2] < 0
    assert history.penetration.max() < 100 * SUNK * capsule.radius  # a tip on a coarse mesh: single nodes are fast


def test_a_plane_that_only_touches_changes_nothing(ball_body):
    clock = clock_for(ball_body, 5, 10)
    resting = Plane((0, 0, ball_body.rest[:, 2].max()), (0, 0, -1))
    history = simulate(Setup(ball_body, ImplicitVolume(), clock, (resting,)))
    assert np.abs(history.contact_force).max() < 1e-9 * 1800 * 0.05**2
    assert np.abs(history.final - ball_body.rest).max() < 1e-12


BAD = {
    "inside": (lambda: (Sphere((0, 0, 0.05), 0.01),), "starts 0.01 m inside"),
    "no direction": (lambda: (Plane((0, 0, 0), (0, 0, 0)),), "needs a direction"),
    "no radius": (lambda: (Sphere((0, 0, 1), 0.0),), "must be positive"),
    "between nodes": (lambda: (Sphere((0.001, 0.002, 0.001), 1e-4),), "starts 0.0001 m inside"),
    "capsule reaches in": (lambda: (Capsule((0, 0, 0.2), (0.001, 0, 0.002), 1e-4),), "starts .* inside the body"),
    "capsule without length": (lambda: (Capsule((0, 0, 1), (0, 0, 1), 0.1),), "give it a length, or use a sphere"),
    "capsule without radius": (lambda: (Capsule((0, 0, 1), (0, 0, 2), 0.0),), "must be positive"),
    "nan capsule": (lambda: (Capsule((0, 0, 1), (0, 0, np.nan), 0.1),), "give finite metres"),
    "negative friction": (lambda: (Plane((0, 0, -1), (0, 0, 1), friction=-0.1),), "friction is -0.1"),
    "unknown friction": (lambda: (Sphere((0, 0, 1), 0.1, friction="sticky"),), "friction is 'sticky'"),  # pyright: ignore
    "nan path": (
        lambda: (Plane((0, 0, 1), (0, 0, -1), Trajectory((0.0, 1.0), ((0, 0, 0), (0, 0, np.nan)))),),
        "not finite",
    ),
    "path back in time": (
        lambda: (Plane((0, 0, 1), (0, 0, -1), Trajectory((1.0, 0.0), ((0, 0, 0), (0, 0, 0)))),),
        "ascend",
    ),
    "ragged path": (lambda: (Plane((0, 0, 1), (0, 0, -1), Trajectory((0.0, 1.0), ((0, 0, 0),))),), "one each"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_obstacles_are_refused(ball_body, name):
    build, words = BAD[name]
    with pytest.raises(MassSpringError, match=words):
        Setup(ball_body, Free(), Clock(0.01, 1, 10), build())


@pytest.mark.parametrize(
    ("nodes", "words"),
    [([], "holds no node"), ([10**6], "names node 1000000"), ([3, 3], "the same node")],
    ids=["empty", "missing", "twice"],
)
def test_bad_attachments_are_refused(ball_body, nodes, words):
    setup = Setup(ball_body, Free(), Clock(0.01, 1, 10), attachments=(Attachment(np.array(nodes, dtype=int)),))
    with pytest.raises(MassSpringError, match=words):
        setup.start()


def test_looking_only_at_near_nodes_changes_no_bit(ball_body):
    """The skip of the contact revision: with the bound on the motion, or looking at every node, the same contacts."""
    clock = clock_for(ball_body, 30, 10)
    planes = squeeze(ball_body, 0.01, clock.duration)
    setup = Setup(ball_body, ImplicitVolume(), clock, planes, damping=30.0)
    state, changes, skipped = setup.start(), 0, 0
    for frame in range(30):
        state = setup.method.advance(state, setup.boundary(frame))
        boundary, net, dt = setup.boundary(frame), state.model, clock.dt
        lightest = net.inverse_mass.max()
        for factor in (-3.0, 0.5, 1.0, 5.0):
            nodes, push = state.nodes, Push(state.nodes.gradient, state.lam[0])
            near, far = (_copied(state.contacts) for _ in range(2))
            for contacts in (near, far):
                find_contacts(net, nodes, contacts, boundary, 0, push)
            lam = factor * state.lam[0]
            mobility = float((net.inverse_mass[:, None] * nodes.gradient**2).sum())
            reach = pressure_reach(lam - state.lam[0], mobility, lightest, dt)
            changed = revise_contacts(net, nodes, near, boundary, 0, Push(nodes.gradient, lam), reach)
            assert changed == revise_contacts(net, nodes, far, boundary, 0, Push(nodes.gradient, lam), np.inf)
            for name in ("contact_id", "mode", "normal", "v_target"):
                assert np.array_equal(getattr(near, name), getattr(far, name))
            changes += changed
            skipped += int((near.predicted_gap[ball_body.surface_nodes] > reach).sum())
    assert changes > 0 and skipped > 0, "the test saw no change of contact, or nothing to skip"


def _copied(contacts):
    return type(contacts)(*(values.copy() for values in contacts))
