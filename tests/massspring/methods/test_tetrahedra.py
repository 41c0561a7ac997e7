"""Pressures and volumes of tetrahedra, known or solved for: derivatives, force balance, dense systems."""

import numpy as np
import pytest

from massspring import METHODS, Clock, Element, Free, Penalty, Pressure, Pyramid, Setup, Xpbd, simulate
from massspring.kernels.arrays.layout import Accuracy
from massspring.kernels.constraint.tetrahedra import cell_rows_into, solve_cells
from massspring.kernels.contact.node_contact import SLIDES
from massspring.kernels.forces.tetrahedron_volumes import add_barycentre_forces, add_volume_forces, cell_slopes
from massspring.kernels.forces.volume import enclosed_volume, pyramid_volume, tetrahedron_volumes_into
from massspring.layout.allocate import start
from massspring.methods.families.tetrahedra import cells_of
from tests.massspring.methods.test_methods import clock_for, squeeze, thrown

BULK = 30_000.0  # Pa
CELL_FORCES = {"element": add_volume_forces, "barycentre": add_barycentre_forces}


def deformed(body, amount=0.02, seed=5):
    return body.rest + amount * body.size * np.random.default_rng(seed).uniform(-1, 1, body.rest.shape)


def cell_volumes(body, x):
    out = np.empty(len(body.tetrahedra))
    tetrahedron_volumes_into(x, body.tetrahedra, out)
    return out


def cell_energy(kind, body, x):
    """Straight from the definitions, in numpy."""
    if kind == "element":
        ratio = cell_volumes(body, x) / body.tetrahedron_volumes - 1
        return 0.5 * BULK * float(body.tetrahedron_volumes @ ratio**2)

    def reach(points):
        corners = points[body.tetrahedra]
        return np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).sum(axis=1)

    weight = 9 * BULK * body.tetrahedron_volumes / reach(body.rest) ** 2
    return 0.5 * float(weight @ (reach(x) - reach(body.rest)) ** 2)


@pytest.mark.parametrize("kind", CELL_FORCES)
def test_cell_forces_are_minus_the_derivative_of_their_energy(block_body, kind):
    x, direction = deformed(block_body), np.random.default_rng(1).normal(size=block_body.rest.shape)
    force = np.zeros_like(x)
    CELL_FORCES[kind](x, cells_of(block_body), BULK, force)
    step = 1e-6 * block_body.size
    after, before = (cell_energy(kind, block_body, x + s * direction) for s in (step, -step))
    assert (force * direction).sum() == pytest.approx((before - after) / (2 * step), rel=1e-6)


def test_the_slopes_of_a_cell_are_those_of_its_volume(block_body):
    x, step = deformed(block_body), 1e-6 * block_body.size
    a, b, c, d = block_body.tetrahedra[3]
    volume, *slopes = cell_slopes(x, (a, b, c, d))
    assert volume == pytest.approx(cell_volumes(block_body, x)[3], rel=1e-12)
    for number, node in enumerate((b, c, d)):
        for axis in range(3):
            move = np.zeros_like(x)
            move[node, axis] = step
            change = cell_volumes(block_body, x + move)[3] - cell_volumes(block_body, x - move)[3]
            assert slopes[number][axis] == pytest.approx(change / (2 * step), rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("kind", CELL_FORCES)
def test_cells_push_nothing_about(block_body, kind):
    """Σ f = 0 and no moment to round-off; the published forces of the barycentre, without the mean, would not."""
    x, force = deformed(block_body), np.zeros_like(block_body.rest)
    CELL_FORCES[kind](x, cells_of(block_body), BULK, force)
    scale = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * scale
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-13 * scale * block_body.size
    if kind == "barycentre":
        corners = x[block_body.tetrahedra]
        spokes = corners - corners.mean(axis=1, keepdims=True)
        length = np.linalg.norm(spokes, axis=2)
        cells = cells_of(block_body)
        push = -9 * BULK * cells.rest_volume * (length.sum(axis=1) - cells.rest_reach) / cells.rest_reach**2
        published = push[:, None, None] * spokes / length[:, :, None]
        assert np.abs(published.sum(axis=(0, 1))).max() > 1e-4 * scale


def test_the_pyramids_fill_the_surface(body):
    """Wherever the centre of mass is; on one triangle less they do not."""
    mass = body.mass * np.random.default_rng(0).uniform(0.1, 3.0, body.node_count)
    x = deformed(body) + 2.0
    whole = enclosed_volume(x, body.triangles)
    assert pyramid_volume(x, mass, body.triangles) == pytest.approx(whole, rel=1e-12)
    assert pyramid_volume(x, mass, body.triangles[:-1]) != pytest.approx(whole, rel=1e-6)


def pressed(body, method, fraction=0.25, duration=2.0):
    """Squeezed by `fraction` of its height within a third of the time, then still."""
    limit = clock_for(body, 1, 1, method=method).dt
    clock = Clock(duration / 40, 40, int(np.ceil(duration / 40 / limit)))
    obstacles = squeeze(body, 0.5 * fraction * np.ptp(body.rest[:, 2]), 0.3 * duration)
    return simulate(Setup(body, method, clock, obstacles, damping=40.0))


def test_the_pyramid_is_a_penalty(ball_body):
    one, other = (pressed(ball_body, method()) for method in (Penalty, Pyramid))
    assert np.abs(one.final - other.final).max() < 1e-9 * ball_body.size
    assert np.abs(one.pressure).max() > 10.0


def test_the_gas_obeys_its_law(ball_body):
    gas, penalty = (pressed(ball_body, method(2_000.0)) for method in (Pressure, Penalty))
    ratio = ball_body.volume / gas.volume[-1, 0]
    assert ratio > 1.01
    assert gas.pressure[-1, 0] == pytest.approx(2_000.0 * (ratio - 1), rel=1e-3)
    assert penalty.pressure[-1, 0] == pytest.approx(2_000.0 * (1 - penalty.volume[-1, 0] / ball_body.volume), rel=1e-3)


NAMING = [m() for m in METHODS if m().added_stiffness.__func__ is not Free.added_stiffness]
ADDING = [method for method in NAMING if method.capabilities.keeps != "elements"]
"""Elements have other bodies (elements/test_explicit_elements.py)."""


def rest_forces(method, body, x):
    """What the method adds to the springs at x, from one step of it out of rest."""
    still = Setup(body, method, Clock(1e-7, 1, 1))
    without = Setup(body, Free(), Clock(1e-7, 1, 1))
    speeds = []
    for setup in (still, without):
        state = setup.start()
        state.nodes.x[:] = x
        speeds.append(setup.method.advance(state, setup.boundary(0)).v)
    return (speeds[0] - speeds[1]) * body.mass[:, None] / 1e-7


@pytest.mark.parametrize("method", ADDING, ids=lambda method: method.name)
def test_the_stiffness_a_method_names_is_the_derivative_of_its_forces(block_body, method):
    factor = method.added_stiffness(block_body)
    direction = np.random.default_rng(1).uniform(-1, 1, block_body.rest.shape)
    step = 1e-6 * block_body.size
    after, before = (rest_forces(method, block_body, block_body.rest + s * direction) for s in (step, -step))
    exact = -(factor @ (factor.T @ direction.ravel())).reshape(-1, 3)
    assert np.abs((after - before) / (2 * step) - exact).max() < 1e-5 * np.abs(exact).max()


def test_methods_that_add_a_force_say_so():
    named = {"penalty", "pressure", "pyramid", "barycentre", "element", "explicit_elements"}
    assert {method.name for method in NAMING} == named
    assert Element(hard=True).added_stiffness(None) is None


def saddle_point(body, cells, nodes, contacts, dt, compliance):
    """Outside truth: [M/dt², −Jᵀ; J, C V0] solved densely, touched nodes as further rows."""
    n, k = body.node_count, len(body.tetrahedra)
    jacobian = np.zeros((k, n, 3))
    slopes = np.concatenate([-cells.slope.sum(axis=1, keepdims=True), cells.slope], axis=1)
    for corner in range(4):
        np.add.at(jacobian, (np.arange(k), body.tetrahedra[:, corner]), slopes[:, corner])
    touched = np.flatnonzero(contacts.mode)
    normal = np.zeros((len(touched), n, 3))
    normal[np.arange(len(touched)), touched] = contacts.normal[touched]
    rows = np.concatenate([dt * jacobian.reshape(k, -1), normal.reshape(len(touched), -1)])
    mass = np.repeat(body.mass, 3)
    soft = np.diag(np.concatenate([compliance * cells.rest_volume, np.zeros(len(touched))]))
    system = np.block([[np.diag(mass), -rows.T], [rows, soft]])
    approach = np.einsum("ij,ij->i", contacts.v_target[touched], contacts.normal[touched])
    right = np.concatenate([mass * nodes.v_star.ravel(), cells.rest_volume - cell_volumes(body, nodes.x), approach])
    return np.linalg.solve(system, right)[: 3 * n + k]


def test_the_hard_solve_equals_the_full_saddle_point(block_body):
    body, dt, compliance = block_body, 1e-3, 1e-5
    state, cells, rng = start(block_body), cells_of(block_body), np.random.default_rng(0)
    net, nodes, contacts = state.model, state.nodes, state.contacts
    nodes.x[:] = deformed(body, 0.002)
    nodes.v_star[:] = 0.1 * rng.normal(size=body.rest.shape)
    touched = np.array([1, 5, 9])
    normals = rng.normal(size=(3, 3))
    contacts.normal[touched] = normals / np.linalg.norm(normals, axis=1)[:, None]
    contacts.direction[touched], contacts.mode[touched] = contacts.normal[touched], SLIDES
    contacts.v_target[touched] = 0.05 * contacts.normal[touched]
    cell_rows_into(nodes.x, cells, cells.right)
    cells.pressure[:] = 100.0  # a warm start must not matter
    count = solve_cells(nodes, contacts, net.inverse_mass, cells, dt, compliance, Accuracy(1e-12, 2000))
    assert count < 35  # 22 in conjugate directions, 46 along the steepest ones
    truth = saddle_point(body, cells, nodes, contacts, dt, compliance)[3 * body.node_count :]
    assert np.abs(cells.pressure - truth).max() < 1e-6 * np.abs(truth).max()


def one_step(body, method, dt=1e-3):
    """After a step out of a shape that is 3 % too small, with some velocity."""
    setup = Setup(body, method, Clock(dt, 1, 1), velocity=0.1 * thrown(body))
    state = setup.start()
    state.nodes.x[:] = 0.99 * body.rest
    return method.advance(state, setup.boundary(0))


def test_xpbd_tends_to_the_volume_solved_for_at_the_end_of_the_step(block_body):
    """Kept multipliers: with iterations p = (V0 − V)/(C V0) in every cell, the compliant law; and V0 as C goes to 0."""
    body = block_body
    for compliance in (1e-4, 1e-5):
        errors = []
        for iterations in (20, 100, 500):
            after = one_step(body, Xpbd(iterations=iterations, compliance=compliance))
            missing = 1 - cell_volumes(body, after.x) / body.tetrahedron_volumes
            errors.append(np.abs(missing - compliance * after.memory.pressure).max())
        assert errors[-1] < 1e-9 or errors[-1] < 0.05 * errors[0]
        assert np.abs(compliance * after.memory.pressure).max() > 1e-4
    soft, hard = (one_step(body, Xpbd(iterations=500, compliance=c)) for c in (1e-5, 1e-9))
    worst = [np.abs(cell_volumes(body, s.x) / body.tetrahedron_volumes - 1).max() for s in (soft, hard)]
    assert worst[1] < 0.02 * worst[0]


def test_sweeps_over_cells_keep_the_whole(block_body):
    """Five leave 2 % in single cells of a pressed block and 3e-8 of their sum; 3e-4 of it where cells have no sum."""
    history = pressed(block_body, Xpbd(), duration=0.3)
    assert history.outcome == "finished" and np.abs(history.contact_force).max() > 1.0
    assert np.abs(history.volume / history.volume_target - 1).max() < 1e-6
    assert np.abs(cell_volumes(block_body, history.final) / block_body.tetrahedron_volumes - 1).max() > 1e-3


def test_xpbd_of_the_whole_is_newton_s_iteration(body):
    """Iterations square the error of the volume, down to round-off."""
    ends = [one_step(body, Xpbd("whole", iterations)).x for iterations in (1, 2, 3, 5)]
    errors = [abs(enclosed_volume(x, body.triangles) / body.volume - 1) for x in ends]
    assert errors[0] > errors[1] > errors[2]
    assert errors[1] < 5 * errors[0] ** 2 and errors[2] < 5 * errors[1] ** 2
    assert errors[3] < 1e-13
