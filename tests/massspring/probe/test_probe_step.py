"""Single steps with a thin probe: contacts together with obstacles and a volume, and what carrying does to both."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Clock, ImplicitVolume, Probe, Setup, Trajectory, Volumes
from massspring.body.inside import mean_edge
from massspring.kernels.arrays.layout import Push
from massspring.kernels.contact.modes import FREE
from massspring.kernels.probe.arrays import CARRIED, CARRYING, LEFT_BEHIND, Stage
from massspring.kernels.probe.contacts import solve_rows
from massspring.kernels.probe.fallback import overshoot
from massspring.kernels.probe.motion import gather, move
from massspring.kernels.probe.pressure import change_of_rows, swelling
from massspring.methods.method import begin_frame
from tests.massspring.methods.test_methods import clock_for
from tests.massspring.probe.test_probe import BALL, pressed, rates_of, required_speeds
from tests.massspring.probe.test_probe_volumes import gradients

METHOD = ImplicitVolume()


@pytest.fixture(params=["whole", "hollow", "regions"])
def any_body(request):
    """One volume by its division, wall and lumen, seven regions."""
    if request.param == "whole":
        return BALL
    if request.param == "hollow":
        return request.getfixturevalue("hollow_body")
    body = request.getfixturevalue("block_body")
    return body.keeping(Volumes.regions(body, 7))


def with_one_row(state):
    """Room for one contact alone: what else a tip runs into is carried."""
    rows = state.probing.rows
    cut = {name: getattr(rows, name)[:1] for name in rows._fields if name not in ("count", "matrix", "small", "part")}
    cut |= {"matrix": rows.matrix[:1, :1], "small": rows.small[:1, :1], "part": rows.part[:, :1]}
    return replace(state, probing=state.probing._replace(rows=rows._replace(**cut)))


def driven_through(body, way):
    """A probe above the middle of a free body at rest goes down by `way` edges within a step."""
    edge, dt, x = mean_edge(body), clock_for(body, 1, 20).dt, body.rest
    tip = np.array([*x[:, :2].mean(axis=0), x[:, 2].max()]) + edge * np.array([0.21, 0.13, 0.05])
    down = Trajectory((0.0, dt), ((0, 0, 0), (0.1 * edge, 0.05 * edge, -(way + 0.05) * edge)))
    return Setup(body, METHOD, Clock(dt, 4, 1), (Probe(tuple(tip), 0.0, down),))


@pytest.mark.parametrize("way", [2.0, 2.6])
def test_a_step_that_carries_nodes_keeps_volumes_and_books_what_the_tip_gives(any_body, way):
    """Outside truth: Newton's law for the whole body, J by differences, and Δtip/dt."""
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
