"""Thin probes: what they push, and single steps with contacts, obstacles and volumes against dense systems."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import (
    Attachment,
    Clock,
    Free,
    ImplicitVolume,
    Plane,
    Probe,
    Setup,
    Sphere,
    Trajectory,
    simulate,
    surface_body,
)
from massspring.body.inside import is_inside, mean_edge
from massspring.kernels.arrays.layout import Push
from massspring.kernels.contact.node_contact import FREE
from massspring.kernels.probe.arrays import CARRIED, CARRYING, COMPARED, IN_CONTACT, LEFT_BEHIND, Stage
from massspring.kernels.probe.contacts import solve_rows
from massspring.kernels.probe.fallback import overshoot
from massspring.kernels.probe.motion import gather, move
from massspring.kernels.probe.pressure import change_of_rows, swelling
from massspring.methods.method import begin_frame
from tests.massspring.conftest import SOFT, body_of, icosphere
from tests.massspring.methods.test_methods import clock_for

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


CELL = 0.02
METHOD = ImplicitVolume()


def pressed_between(body, depth=0.008, frames=40, steps=20, slide=0.0, **options):
    """A probe that comes down between the nodes of the upper side, and may slide then; the lower side is held."""
    clock = clock_for(body, frames, steps)
    top = body.rest[:, 2].max()
    keys = ((0, 0, 0), (0, 0, -depth - 0.004), (slide, 0, -depth - 0.004))
    way = Trajectory((0.0, 0.4 * clock.duration, clock.duration), keys)
    probe = Probe((1.4 * CELL, 1.6 * CELL, top + 0.004), 0.0, way)
    held = Attachment(np.flatnonzero(body.rest[:, 2] < 0.25 * CELL))
    return Setup(body, METHOD, clock, (probe,), (held,), damping=30.0, **options)


def in_contact(setup):
    """The state before the last frame, and the number of that frame."""
    state = setup.start()
    for frame in range(setup.clock.frames - 1):
        state = METHOD.advance(state, setup.boundary(frame))
    assert state.probing.counts[IN_CONTACT] > 20
    return state, setup.clock.frames - 1


def gradients(body, x):
    """dV/dx by central differences [m²], (m, 3n): exact to h², as a volume is a cubic."""
    step, columns = 1e-3 * CELL, []
    for k in range(x.size):
        moved = [x.copy(), x.copy()]
        for y, sign in zip(moved, (1, -1), strict=True):
            y.reshape(-1)[k] += sign * step
        columns.append((body.kept.measure(moved[0]) - body.kept.measure(moved[1])) / (2 * step))
    return np.stack(columns, axis=1)


def test_contact_and_volumes_equal_the_saddle_point(several):
    """Outside truth: what the probe adds to one step is W (Cᵀ c + dt Jᵀ δ) with J·(v⁺ − u) = 0, J by differences."""
    setup = pressed_between(several, frames=400, steps=1)
    before, frame = in_contact(setup)
    boundary = setup.boundary(frame)
    touched = METHOD.advance(before, boundary)
    alone = METHOD.advance(replace(before, probing=None), boundary)
    rows = touched.probing.rows
    impulse = rows.impulse[: rows.count[0]]
    assert (impulse >= 0).all() and impulse.max() > 0
    difference = (touched.v - alone.v).ravel()
    jacobian = gradients(several, before.x)
    scale = np.abs(jacobian) @ np.abs(difference)
    assert np.abs(jacobian @ difference).max() < 1e-5 * scale.max()  # an iteration leaves 1e-7 of the largest flow
    c = np.zeros((len(impulse), *touched.x.shape))
    for k in range(len(impulse)):
        for q in range(3):
            c[k, rows.node[k, q]] += rows.weight[k, q] * rows.direction[k]
    free = np.repeat(touched.model.inverse_mass > 0, 3)
    force = (np.repeat(touched.model.mass, 3) * difference - np.einsum("k,kij->ij", impulse, c).ravel())[free]
    pressures = np.linalg.lstsq(jacobian.T[free], force, rcond=None)[0]
    left = force - jacobian.T[free] @ pressures
    assert np.abs(left).max() < 1e-6 * impulse.max()
    assert np.abs(pressures).max() > 0
    # What presses touches: the surface ends the step at the radius, within the linear solve.
    tip = setup.probes[0].anchor + setup.probes[0].path((frame + 1) * setup.clock.frame)
    gap = np.einsum("kij,ij->k", c, touched.x) - rows.direction[: len(impulse)] @ tip
    pressing = impulse > 0
    assert np.abs(gap[pressing] - touched.probing.radius[0]).max() < 1e-6 * CELL


def test_volumes_are_kept_and_forces_balance(several):
    history = simulate(pressed_between(several, frames=120, slide=0.2 * CELL))
    assert history.outcome == "finished" and history.probe_counts[:, LEFT_BEHIND].sum() == 0
    assert np.abs(history.volume / several.kept.measure(several.rest) - 1).max() < 1e-4
    contact, reaction = history.contact_force[-1, 0], history.held_force[-1, 0]
    assert contact[2] < 0
    assert np.abs(contact + reaction).max() < 0.05 * np.abs(contact).max()  # it has slid until now


def with_one_row(state):
    """Room for one contact alone: what else a tip runs into is carried."""
    rows = state.probing.rows
    cut = {name: getattr(rows, name)[:1] for name in rows._fields if name not in ("count", "matrix", "small", "part")}
    cut |= {"matrix": rows.matrix[:1, :1], "small": rows.small[:1, :1], "part": rows.part[:, :1]}
    # In one piece, as compiled code has them: another layout would be another type, compiled for half a minute.
    cut = {name: np.ascontiguousarray(part) for name, part in cut.items()}
    return replace(state, probing=state.probing._replace(rows=rows._replace(**cut)))


def driven_through(body, way):
    """A probe above the middle of a free body at rest goes down by `way` edges within a step."""
    edge, dt, x = mean_edge(body), clock_for(body, 1, 20).dt, body.rest
    tip = np.array([*x[:, :2].mean(axis=0), x[:, 2].max()]) + edge * np.array([0.21, 0.13, 0.05])
    down = Trajectory((0.0, dt), ((0, 0, 0), (0.1 * edge, 0.05 * edge, -(way + 0.05) * edge)))
    return Setup(body, METHOD, Clock(dt, 4, 1), (Probe(tuple(tip), 0.0, down),))


@pytest.mark.parametrize(("kind", "way"), [("whole", 2.0), ("hollow", 2.6), ("regions", 2.0), ("nodal", 2.6)])
def test_a_step_that_carries_nodes_keeps_volumes_and_books_what_the_tip_gives(kind, way, request):
    """Outside truth: Newton's law for the whole body, J by differences, and Δtip/dt."""
    any_body = BALL if kind == "whole" else body_of(kind, request)
    setup = driven_through(any_body, way)
    before = with_one_row(setup.start())
    boundary = setup.boundary(0)
    after = METHOD.advance(before, boundary)
    counts, v = after.probing.counts, after.v
    assert counts[CARRYING] == 1 and counts[LEFT_BEHIND] == 0
    tip = (boundary.tips.end[0, 0] - boundary.tips.start[0, 0]) / boundary.dt
    carried = np.abs(v - tip).max(axis=1) < 1e-9 * np.linalg.norm(tip)
    assert carried.sum() == counts[CARRIED] >= 3
    impulse = (before.model.mass[:, None] * v).sum(axis=0)
    assert np.abs(after.diagnostics.contact_impulse[0] - impulse).max() < 1e-9 * np.abs(impulse).max()
    # From rest, with volumes as they should be, the rates of all volumes stay zero: others make room.
    jacobian = gradients(any_body, before.x)
    assert np.abs(jacobian @ v.ravel()).max() < 1e-6 * (np.abs(jacobian) @ np.abs(v.ravel())).max()
    assert np.abs(v[~carried]).max() > 0.01 * np.linalg.norm(tip)
    # And nothing is left over for the next step.
    assert not after.probing.carried.any() and not after.probing.push.any() and not after.contacts.mode.any()


def some_rows(stage, rng, count=5):
    """Contacts of one tip with triangles that share nodes, some of which obstacles or attachments hold."""
    rows, nodes, contacts = stage.probes.rows, stage.nodes, stage.contacts
    rows.count[0], rows.probe[:count] = count, 0
    rows.triangle[:count] = rng.choice(8, count, replace=False)
    rows.node[:count] = stage.probes.surface[rows.triangle[:count]]
    rows.weight[:count] = rng.dirichlet(np.ones(3), count)
    rows.direction[:count] = rng.normal(size=(count, 3))
    rows.direction[:count] /= np.linalg.norm(rows.direction[:count], axis=1)[:, None]
    # The tip at their centre: some rows need a push, others none.
    at = np.einsum("kq,kqi->ki", rows.weight[:count], nodes.x[rows.node[:count]])
    stage.tips.end[0, 0] = at.mean(axis=0)
    contacts.mode[:] = FREE
    among, others = np.unique(rows.node[:count]), np.arange(BALL.node_count)
    chosen = np.concatenate([rng.permutation(among)[:3], np.setdiff1d(others, among)[:30]])
    contacts.mode[chosen] = rng.permutation(np.arange(len(chosen)) % 3 + 1)
    contacts.direction[chosen] = rng.normal(size=(len(chosen), 3))
    contacts.direction[chosen] /= np.linalg.norm(contacts.direction[chosen], axis=1)[:, None]
    contacts.v_target[chosen] = np.einsum(
        "nij,nj->ni", taken_from(contacts)[chosen], 0.02 * rng.normal(size=(len(chosen), 3))
    )


def taken_from(contacts):
    """The projection on the directions that obstacles take from each node, (n, 3, 3)."""
    outer = np.einsum("ni,nj->nij", contacts.direction, contacts.direction)
    return np.choose(contacts.mode[:, None, None], [0 * outer, outer, np.eye(3) - outer, 0 * outer + np.eye(3)])


def random_step(seed, lam):
    """A step with contacts, obstacles and attachments, and random velocities; the projection left to each node."""
    setup, rng = pressed(METHOD), np.random.default_rng(seed)
    after, boundary = begin_frame(setup.start(), setup.boundary(0)), setup.boundary(0)
    probing, nodes, contacts, net = after.probing, after.nodes, after.contacts, after.model
    nodes.v_star[:], nodes.gradient[:] = 0.02 * rng.normal(size=(2, *nodes.x.shape))
    nodes.v_star[net.held_nodes] = 0.0
    nodes.gradient[:] *= 0.01
    stage = Stage(net, nodes, contacts, boundary.tips, probing, None, 0.0, 0, boundary.dt)
    some_rows(stage, rng)
    contacts.mode[net.held_nodes] = FREE
    kept, g = np.eye(3) - taken_from(contacts), nodes.gradient
    stage = stage._replace(mobility=float(np.einsum("n,ni,nij,nj->", net.inverse_mass, g, kept, g)))
    probing.near[0], probing.near_count[0] = np.arange(len(probing.surface)), len(probing.surface)
    gather(stage, Push(stage.nodes.gradient, lam))
    return stage, kept


@pytest.mark.parametrize("seed", range(6))
def test_contacts_beside_obstacles_equal_the_full_saddle_point(seed):
    """Outside truth: Newton's law for all nodes with every constraint in one dense system: least squares of numpy."""
    lam = 40.0
    stage, kept = random_step(seed, lam)
    probing, nodes, contacts, dt = stage.probes, stage.nodes, stage.contacts, stage.dt
    g, w = nodes.gradient, stage.model.inverse_mass
    bound = solve_rows(stage, None)
    move(stage, None)
    u = np.einsum("nij,nj->ni", kept, nodes.v_star + dt * lam * w[:, None] * g)
    u += contacts.v_target * (contacts.mode > FREE)[:, None]
    on = np.unique(BALL.triangles)
    assert np.allclose(probing.base[on], u[on], atol=1e-14)
    velocity = np.where(np.isin(np.arange(len(u)), on)[:, None], probing.velocity, u)
    impulse, c = probing.rows.impulse[:5], rates_of(probing.rows, 5, u.shape)
    required, pressing = required_speeds(stage, c), impulse > 0
    assert pressing.any()
    # W̃ M̃ = I on what is left to each node: the multipliers of obstacles and attachments drop out.
    mobile = np.einsum("n,nij->nij", w, kept)
    rates = np.vstack([c[pressing].reshape(pressing.sum(), -1), dt * g.ravel()[None]])
    moved = np.einsum("nij,knj->kni", mobile, rates.reshape(len(rates), -1, 3)).reshape(len(rates), -1)
    right = np.concatenate([required[pressing] - rates[:-1] @ u.ravel(), [0.0]])
    truth = np.linalg.solve(rates @ moved.T, right)
    assert np.allclose(truth[:-1], impulse[pressing], rtol=1e-6)
    assert truth[-1] == pytest.approx(probing.change[0], rel=1e-6)
    assert np.allclose((u + (truth @ moved).reshape(-1, 3))[on], velocity[on], atol=1e-9)
    gap = np.einsum("kij,ij->k", c, velocity) - required
    # But where obstacles hold all that a contact would push.
    movable = np.einsum("kni,nij,knj->k", c, mobile, c) > 1e-9 * w.max()
    assert movable.sum() >= 4 and (gap[movable] > -1e-6 * np.abs(required).max()).all()
    # What the broad phase goes by: nothing is faster than the speed it was given.
    assert np.linalg.norm(velocity - u, axis=1).max() <= bound
    swollen = np.array([swelling(stage, None, i) for i in range(len(u))])
    assert 0 < np.linalg.norm(swollen, axis=1).max() <= change_of_rows(stage)


def led(weight, held, radius=0.0):
    """A triangle of which all but the corner `held` are carried and sent ahead of a tip: (stage, corners, answer)."""
    setup, rng = pressed(METHOD), np.random.default_rng(3)
    after, boundary = begin_frame(setup.start(), setup.boundary(0)), setup.boundary(0)
    probing = after.probing
    corners = probing.surface[0].astype(int)
    probing.near[0, 0], probing.passing[0, :3], probing.radius[0] = 0, weight, radius
    probing.velocity[corners] = 0.1 * rng.normal(size=(3, 3))
    probing.pair.tip[:] = 1e-3 * rng.normal(size=(2, 3))
    probing.carried[np.delete(corners, held)] = 1
    stage = Stage(after.model, after.nodes, after.contacts, boundary.tips, probing, None, 0.0, 0, boundary.dt)
    return stage, corners, overshoot(stage, 0, 0)


@pytest.mark.parametrize("radius", [0.0, 2e-3])
def test_carried_corners_go_ahead_until_the_point_that_is_passed_rests(radius):
    """Seen from the tip, or a radius farther; by their weights, as a contact would push them; the held one not."""
    weight = np.array([0.5, 0.2, 0.3])
    stage, corners, moved = led(weight, 0, radius)
    push, pair = stage.probes.push[corners], stage.probes.pair
    missing = (pair.tip[1] - pair.tip[0]) / stage.dt - weight @ stage.probes.velocity[corners]
    farther = radius / stage.dt * missing / np.linalg.norm(missing)
    assert moved and np.allclose(weight @ push, missing + farther, rtol=1e-12)
    assert not push[0].any() and np.allclose(push[1] / 0.2, push[2] / 0.3, rtol=1e-12)


@pytest.mark.parametrize(("weight", "moved"), [((0.97, 0.02, 0.01), True), ((0.985, 0.01, 0.005), False)])
def test_a_tip_that_hits_almost_the_held_corner_is_stopped_by_it(weight, moved):
    """A free corner would have to go more than fifty times as far as the tip."""
    stage, _, answer = led(np.array(weight), 0)
    assert answer == moved == stage.probes.push.any()
