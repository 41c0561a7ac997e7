"""What lets a thin probe pass over most triangles never passes over one that it meets."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Clock, Free, ImplicitVolume, Probe, Setup, Trajectory
from massspring.kernels.arrays.layout import Push
from massspring.kernels.contact.node_contact import FREE, ON_EDGE, SLIDES, STICKS
from massspring.kernels.probe.arrays import IN_CONTACT
from massspring.kernels.probe.broad_phase import fastest_node
from massspring.kernels.probe.continuous import NEVER, crossing, nearest_into, passes_by, stays_off
from tests.massspring.conftest import list_active
from tests.massspring.kernels.probe.test_continuous import pair_of
from tests.massspring.kernels.probe.test_stage import BALL, EDGE, R, pressed


@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("fast", ["free", "held by an obstacle"])
def test_no_node_is_faster_than_the_fastest(fast, precision):
    """Outside truth: v⁺ of all nodes by numpy; the node that is fastest is free, or slides on an obstacle."""
    setup = replace(pressed(ImplicitVolume()), precision=precision)
    state, dt, lam, rng = setup.start(), setup.clock.dt, 30.0, np.random.default_rng(3)
    net, nodes, contacts = state.model, state.nodes, state.contacts
    for trial in range(20):
        nodes.v_star[:], nodes.gradient[:] = rng.normal(size=(2, *nodes.x.shape)) * [[[1.0]], [[1e-4]]]
        contacts.mode[:] = FREE
        chosen = rng.choice(BALL.node_count, 5, replace=False)
        contacts.mode[chosen] = [SLIDES, SLIDES, ON_EDGE, STICKS, STICKS]
        list_active(contacts)
        contacts.direction[chosen] = np.eye(3)[rng.integers(3, size=5)]
        contacts.v_target[chosen] = 0.1 * rng.normal(size=(5, 3))
        if fast == "free":
            nodes.v_star[np.setdiff1d(np.arange(BALL.node_count), chosen)[trial]] *= 10.0
        else:
            contacts.v_target[chosen[trial % 5]] *= 100.0
        u = nodes.v_star + dt * lam * net.inverse_mass[:, None] * nodes.gradient
        for i in chosen:
            d = contacts.direction[i]
            kept = {SLIDES: np.eye(3) - np.outer(d, d), ON_EDGE: np.outer(d, d), STICKS: np.zeros((3, 3))}[
                int(contacts.mode[i])
            ]
            u[i] = kept @ u[i] + contacts.v_target[i]
        truth = np.linalg.norm(u, axis=1).max()
        speed = fastest_node(net, nodes, contacts, Push(nodes.gradient, lam), dt)
        assert speed >= truth * (1 - 1e-6)  # what SAFE makes up for
        assert speed <= truth * (1 + 1e-6)  # the fastest is made to stand out: the bound is sharp


def test_a_pair_is_passed_over_only_where_nothing_crosses():
    rng = np.random.default_rng(5)
    over = crossed = 0
    for _ in range(4000):
        begin = rng.normal(size=(3, 3)) + 0.6 * rng.normal(size=3)
        pair = pair_of(begin, begin + rng.normal(size=3) + 0.2 * rng.normal(size=(3, 3)))
        t = crossing(pair)
        crossed += t <= 1.0
        if passes_by(pair):
            over += 1
            assert t == NEVER
    assert over > 1500 and crossed > 100, "the pairs show nothing"


def test_a_corner_that_the_tip_just_grazes_is_not_passed_over():
    """The triangle lies in x ≥ 0 throughout, and has a corner at the tip's x: a crossing through its rim."""
    corners, up, right = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0]]), np.eye(3)[2], np.eye(3)[0]
    pair = pair_of(corners + up, corners - up)
    assert not passes_by(pair)
    assert crossing(pair) == pytest.approx(0.5, abs=1e-9)
    assert passes_by(pair_of(corners + up + 1e-6 * right, corners - up + 1e-6 * right))


def test_what_stays_off_is_farther_than_the_radius():
    rng = np.random.default_rng(6)
    weight, off = np.zeros(3), 0
    for _ in range(2000):
        corners = rng.normal(size=(3, 3)) + rng.normal(size=3)
        if stays_off(corners, 0.3):
            off += 1
            assert nearest_into(corners, weight) > 0.3
    assert 500 < off < 1900
    near = np.array([[0.3, -1.0, -1.0], [0.3, 1.0, -1.0], [0.3, 0.0, 1.0]])
    assert not stays_off(near, 0.3)  # touches: its distance is the radius
    assert stays_off(near + 1e-6 * np.eye(3)[0], 0.3)


@pytest.mark.parametrize("way", [0.1, 1.0, 2.2])
def test_a_tip_from_afar_wakes_what_it_meets(way):
    """Far pairs sleep while tip and ball come nearer, slowly or not, then the tip crosses: no bit is lost.

    `way`: of the tip in a step, in radii of the ball.
    """
    dt = pressed(Free()).clock.dt
    down = Trajectory((6 * dt, 6 * dt + 4.0 / way * dt), ((0, 0, 0), (0.1 * R, 0.05 * R, -4.0 * R)))
    velocity = np.full(BALL.rest.shape, 0.05 * R / dt) * [0.3, -0.2, 0.5]
    probe = Probe((0.1 * R, 0.2 * R, 2.5 * R), 0.1 * EDGE, down)
    setup, ends = Setup(BALL, Free(), Clock(dt, 6 + int(np.ceil(2.6 / way)), 1), (probe,), velocity=velocity), []
    for skipping in (True, False):
        state = setup.start()
        state = replace(state, probing=state.probing._replace(skipping=skipping))
        for frame in range(setup.clock.frames):
            state = setup.method.advance(state, setup.boundary(frame))
        ends.append((state.x, state.v, state.diagnostics.contact_impulse))
        assert state.probing.counts[IN_CONTACT] > 0
    assert all(np.array_equal(a, b) for a, b in zip(*ends, strict=True))
