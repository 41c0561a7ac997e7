"""Thin probes: what they push, what they cannot pass, and that looking less changes nothing."""

import numpy as np
import pytest

from massspring import (
    Attachment,
    Clock,
    Free,
    ImplicitVolume,
    MassSpringError,
    Plane,
    Probe,
    Setup,
    Sphere,
    Trajectory,
    Xpbd,
    simulate,
    surface_body,
)
from massspring.body.inside import is_inside, mean_edge
from massspring.kernels.arrays.layout import Push
from massspring.kernels.contact.modes import FREE
from massspring.kernels.probe.arrays import COMPARED, IN_CONTACT, LEFT_BEHIND, Stage
from massspring.kernels.probe.contacts import solve_rows
from massspring.kernels.probe.motion import gather
from massspring.methods.method import begin_frame
from tests.massspring.conftest import SOFT, icosphere
from tests.massspring.methods.test_methods import clock_for, thrown

R = 0.05
METHODS = [Free(), ImplicitVolume()]
BALL = surface_body(*icosphere(2), SOFT)
EDGE = mean_edge(BALL)
BOTH = pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)


def pressed(method, radius=0.0, depth=0.02, frames=60, slide=0.0, **options):
    """A probe that comes down on the ball between its nodes, and may slide then; the ball is held below."""
    clock = clock_for(BALL, frames, 20)
    keys = ((0, 0, 0), (0, 0, -depth), (slide, 0, -depth))
    way = Trajectory((0.0, 0.4 * clock.duration, clock.duration), keys)
    probe = Probe((0.003, 0.002, R + 0.002 + radius), radius, way)
    held = Attachment(np.flatnonzero(BALL.rest[:, 2] < -0.04))
    return Setup(BALL, method, clock, (probe,), (held,), damping=30.0, **options)


def frames_of(setup):
    state = setup.start()
    for frame in range(setup.clock.frames):
        state = setup.method.advance(state, setup.boundary(frame))
        yield (frame + 1) * setup.clock.frame, state


@BOTH
def test_a_point_presses_where_a_thin_sphere_slips_through(method):
    """The same path: a sphere a hundredth of an edge wide meets no node and no force, and stands inside the ball."""
    setup = pressed(method)
    history = simulate(setup)
    assert history.contact_force[-1, 0, 2] < -1e-4 * SOFT.shear_modulus * R**2
    assert history.penetration.max() < 0.01 * EDGE
    end = setup.probes[0].anchor + setup.probes[0].path(history.t[-1])
    assert not is_inside(end, history.final, BALL.triangles)
    sphere = Sphere(setup.probes[0].tip, 1e-3 * EDGE, setup.probes[0].path)
    slipped = simulate(Setup(BALL, method, setup.clock, (sphere,), setup.attachments, damping=30.0))
    assert np.abs(slipped.contact_force).max() == 0.0
    assert is_inside(end, slipped.final, BALL.triangles)


@BOTH
def test_forces_balance_and_nothing_pulls(method):
    """At rest contact + reaction = 0; a frictionless point pushes along its own normals only, into the body."""
    history = simulate(pressed(method, frames=150))
    contact, reaction = history.contact_force[-1, 0], history.held_force[-1, 0]
    assert np.abs(contact + reaction).max() < 2e-3 * np.abs(contact).max()  # what of the motion is left by then
    assert (history.contact_force[:, 0, 2] <= 0).all()


def test_the_volume_is_kept_beside_the_contact():
    history = simulate(pressed(ImplicitVolume(), frames=150, slide=0.01))
    assert np.abs(history.volume / BALL.volume - 1).max() < 1e-4
    still = simulate(pressed(ImplicitVolume(), frames=150))
    assert abs(still.volume[-1, 0] / BALL.volume - 1) < 1e-6


@BOTH
def test_an_attachment_bears_what_presses_on_its_nodes(method):
    """A point on a triangle with two held nodes: their share of the push goes straight into the reaction."""
    setup = pressed(method, depth=0.004, frames=150)
    tip = setup.probes[0].anchor
    near = np.argsort(np.linalg.norm(BALL.rest - tip, axis=1))[:2]
    held = Attachment(np.append(setup.attachments[0].nodes, near))
    history = simulate(Setup(BALL, method, setup.clock, setup.obstacles, (held,), damping=60.0))
    contact, reaction = history.contact_force[-1, 0], history.held_force[-1, 0]
    assert contact[2] < -1e-4 * SOFT.shear_modulus * R**2
    # The springs still creep a little; the share that must not be lost is more than half.
    assert np.abs(contact + reaction).max() < 1e-2 * np.abs(contact).max()


def rates_of(rows, count, shape):
    """Constraint rows on the velocities of all nodes: Σ b n, (count, n, 3)."""
    rates = np.zeros((count, *shape))
    for k in range(count):
        for q in range(3):
            rates[k, rows.node[k, q]] += rows.weight[k, q] * rows.direction[k]
    return rates


def required_speeds(stage, rates):
    """How fast (count,) the corners of each row must leave its tip in the step [m/s]."""
    rows, probes = stage.probes.rows, stage.probes
    probe, direction = rows.probe[: len(rates)], rows.direction[: len(rates)]
    tip = np.einsum("ki,ki->k", direction, stage.tips.end[stage.step, probe])
    return (probes.radius[probe] - np.einsum("kij,ij->k", rates, stage.nodes.x) + tip) / stage.dt


def disturbed_contact():
    """A step in which a tip presses on some triangles; velocities are random, and directions are changed at random."""
    setup = pressed(ImplicitVolume(), frames=60, slide=0.01)
    state = None
    for _, state in frames_of(setup):
        if state.probing.rows.count[0] > 3:
            break
    boundary = setup.boundary(59)
    after = begin_frame(state, boundary)
    nodes, contacts, net = after.nodes, after.contacts, after.model
    rows, rng = after.probing.rows, np.random.default_rng(4)
    nodes.v_star[:] = 0.02 * rng.normal(size=nodes.v_star.shape)
    nodes.v_star[net.held_nodes] = 0.0
    contacts.mode[:] = FREE
    contacts.active_count[0] = 0
    count = int(rows.count[0])
    rows.direction[:count] += 0.3 * rng.normal(size=(count, 3))
    rows.direction[:count] /= np.linalg.norm(rows.direction[:count], axis=1)[:, None]
    mobility = float((net.inverse_mass[:, None] * nodes.gradient**2).sum())
    after.probing.near[0], after.probing.near_count[0] = np.arange(len(net.triangles)), len(net.triangles)
    return Stage(net, nodes, contacts, boundary.tips, after.probing, None, mobility, 0, boundary.dt)


def test_contacts_and_volume_equal_the_full_saddle_point_solve():
    """Outside truth: [M, −Cᵀ, −Gᵀ; C, 0; G, 0] solved densely for the rows that press."""
    stage, lam = disturbed_contact(), 50.0
    probing, nodes, net, dt = stage.probes, stage.nodes, stage.model, stage.dt
    g, rows, count = nodes.gradient, probing.rows, int(probing.rows.count[0])
    u = nodes.v_star + dt * lam * net.inverse_mass[:, None] * g
    gather(stage, Push(stage.nodes.gradient, lam))
    solve_rows(stage, None)
    pressure = lam + probing.change[0]
    impulse = rows.impulse[:count]
    assert (impulse >= 0).all() and (impulse > 0).sum() > 0
    velocity = nodes.v_star + net.inverse_mass[:, None] * dt * pressure * g + probing.push
    assert np.array_equal(rows.node[:count], probing.surface[rows.triangle[:count]])
    c = rates_of(rows, count, u.shape)
    required = required_speeds(stage, c)
    pressing = impulse > 0
    free = np.repeat(net.inverse_mass > 0, 3)
    constraints = np.vstack([c[pressing].reshape(pressing.sum(), -1), dt * g.ravel()])[:, free]
    mass = np.repeat(net.mass, 3)[free]
    right = np.concatenate([required[pressing], [dt * (g * u).sum()]])
    zero = np.zeros((len(right), len(right)))
    system = np.block([[np.diag(mass), -constraints.T], [constraints, zero]])
    solution = np.linalg.solve(system, np.concatenate([mass * u.ravel()[free], right]))
    assert np.allclose(solution[len(mass) : -1], impulse[pressing], rtol=1e-6)
    assert solution[-1] == pytest.approx(pressure - lam, rel=1e-6)
    assert np.allclose(solution[: len(mass)], velocity.ravel()[free], atol=1e-9)
    # Rows that do not press are not violated, and complementarity holds.
    gap = np.einsum("kij,ij->k", c, velocity) - required
    assert (gap > -1e-6 * np.abs(required).max()).all()
    assert np.abs(gap * impulse).max() < 1e-6 * np.abs(required).max() * impulse.max()


@BOTH
@pytest.mark.parametrize("radius", [0.0, 0.3 * EDGE])
def test_sleeping_pairs_and_boxes_change_no_bit(method, radius):
    """And they skip nearly everything: of 320 triangles a few are compared in a step."""
    setup = pressed(method, radius, frames=40, slide=0.02)
    boxes = []
    ends = []
    for skipping in (True, False):
        state = setup.start()
        state = state.__class__(**{**vars(state), "probing": state.probing._replace(skipping=skipping)})
        for frame in range(setup.clock.frames):
            state = setup.method.advance(state, setup.boundary(frame))
        assert state.probing.counts[IN_CONTACT] > 100, "the probe hardly ever touched"
        boxes.append(state.probing.counts[COMPARED] / (20 * setup.clock.frames))
        ends.append((state.x, state.v, state.lam, state.diagnostics.contact_impulse))
    assert all(np.array_equal(a, b) for a, b in zip(*ends, strict=True))
    assert boxes[1] >= len(BALL.triangles)
    assert boxes[0] < 0.3 * boxes[1]


@BOTH
def test_a_probe_that_meets_nothing_changes_no_bit(method):
    clock = clock_for(BALL, 4, 10)
    v = thrown(BALL)
    far = (Probe((0.5, 0.0, 0.0)),)
    alone = Setup(BALL, method, clock, velocity=v)
    assert alone.start().probing is None  # the frame is compiled without the stage
    assert np.array_equal(simulate(Setup(BALL, method, clock, far, velocity=v)).final, simulate(alone).final)


def test_forces_come_in_the_order_of_the_obstacles():
    clock = clock_for(BALL, 40, 20)
    plane = Plane((0, 0, -R), (0, 0, 1))
    down = Trajectory((0.0, 0.5 * clock.duration), ((0, 0, 0), (0, 0, -0.01)))
    probe = Probe((0.003, 0.002, R + 0.002), 0.0, down)
    history = simulate(Setup(BALL, ImplicitVolume(), clock, (probe, plane), damping=60.0))
    assert history.contact_force[-1, 0, 2] < 0 < history.contact_force[-1, 1, 2]
    assert history.contact_force[-1, :, 2].sum() == pytest.approx(0, abs=0.05 * history.contact_force[-1, 1, 2])


def test_the_history_counts_what_probes_did():
    setup = pressed(ImplicitVolume(), frames=40)
    history = simulate(setup)
    *_, (_, state) = frames_of(setup)
    assert np.array_equal(history.probe_counts.sum(axis=0), state.probing.counts)
    assert history.probe_counts[-1, IN_CONTACT] == 20 and history.probe_counts[:, LEFT_BEHIND].sum() == 0
    assert 0 < history.probe_counts[:, COMPARED].sum() < 0.3 * 40 * 20 * len(BALL.triangles)


BAD = {
    "inside": (lambda: Probe((0.001, 0.0, 0.002)), {}, "starts .* inside the body"),
    "its ball reaches in": (lambda: Probe((0.0, 0.0, R + 0.002), 0.3 * EDGE), {}, "starts .* inside the body"),
    "path starts inside": (lambda: Probe((0, 0, 1), path=Trajectory((0.0,), ((0, 0, -1.0),))), {}, "starts .* inside"),
    "nan path": (lambda: Probe((0, 0, 1), path=Trajectory((0.0, 1.0), ((0, 0, 0), (0, np.nan, 0)))), {}, "not finite"),
    "nan tip": (lambda: Probe((0, 0, np.nan)), {}, "give finite metres"),
    "negative radius": (lambda: Probe((0, 0, 1), -0.1), {}, "zero or positive"),
    "nan radius": (lambda: Probe((0, 0, 1), np.nan), {}, "zero or positive"),
    "too thick": (lambda: Probe((0, 0, 1), 2 * EDGE), {}, "use a Sphere, or a finer surface"),
    "other method": (
        lambda: Probe((0, 0, 1)),
        {"method": Xpbd("whole")},
        "'xpbd' does not support thin probes .*: it does not correct the volumes again",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_probes_are_refused(name):
    build, other, words = BAD[name]
    method = other.get("method", Free())
    with pytest.raises(MassSpringError, match=words):
        Setup(BALL, method, Clock(0.01, 1, 10), (build(),))
