"""The multipliers of several volumes at once: rows, solves, contact, targets that move."""

from dataclasses import replace

import numpy as np
import pytest

import massspring.kernels.motion as motion_kernels
import massspring.methods.rows as rows_module
from massspring import (
    Attachment,
    Body,
    ImplicitVolume,
    Ramp,
    Setup,
    Volumes,
    simulate,
)
from massspring.kernels.deformation import tetrahedron_volumes_into
from massspring.kernels.layout import Accuracy
from massspring.kernels.multipliers import solve_iteratively
from massspring.kernels.rows import diagonal_into, rows_into, transposed_rows_times_into
from massspring.methods.base import new_tally, start
from massspring.methods.implicit_volume import set_right_side, solve_multipliers
from massspring.methods.rows import volume_rows
from tests.massspring.test_kernels import ROUND_OFF, directional, moved
from tests.massspring.test_methods import clock_for, squeeze

SEVERAL = ("hollow", "regions", "nodal")


@pytest.fixture(params=SEVERAL)
def several(request: pytest.FixtureRequest, block_body: Body, hollow_body: Body) -> Body:
    """Bodies that keep more than one volume."""
    kinds = {"regions": Volumes.regions(block_body, 7), "nodal": Volumes.nodal(block_body)}
    return hollow_body if request.param == "hollow" else block_body.keeping(kinds[request.param])


def test_rows_are_the_derivative_of_the_volumes(several):
    rows = volume_rows(several.kept, several.node_count)
    x = moved(several)
    rows_into(x, 1.0 / several.mass, rows)
    assert np.allclose(rows.volume, several.kept.measure(x), rtol=1e-12)
    random = np.random.default_rng(2)
    direction, pressure = random.uniform(-1, 1, x.shape), random.uniform(-1, 1, several.kept.count)
    force = np.empty_like(x)
    transposed_rows_times_into(rows, pressure, force)
    exact = float((force * direction).sum())
    assert directional(lambda y: float(pressure @ several.kept.measure(y)), x, direction) == pytest.approx(
        exact, rel=1e-7
    )
    assert np.abs(force.sum(axis=0)).max() < ROUND_OFF * np.abs(force).sum()


def touched_and_held(body: Body, dt: float):
    """A state in motion, its rows filled: two nodes held, three sliding, one in a wedge, one sticking.

    And what that fixes: (node, direction, velocity along it [m/s]).
    """
    random = np.random.default_rng(0)
    held, touched = np.array([5, 17]), np.array([20, 21, 30])
    state = start(body, (Attachment(held),), v=0.1 * random.normal(size=body.rest.shape))
    mo, rows = state.motion, state.rows
    mo.v_star[:] = state.v
    mo.v_star[held] = [0.02, 0.0, -0.01]
    normals = random.normal(size=(3, 3))
    mo.normal[touched] = normals / np.linalg.norm(normals, axis=1)[:, None]
    approach = 0.05 * random.normal(size=3)
    mo.touched[touched], mo.locked[touched] = 1, 1
    mo.direction[touched] = mo.normal[touched]
    mo.goal[touched] = approach[:, None] * mo.normal[touched]
    edge, wedged, stuck = np.linalg.qr(random.normal(size=(3, 3)))[0], 31, 40
    mo.touched[[wedged, stuck]] = 1
    mo.locked[[wedged, stuck]] = 2, 3
    mo.direction[wedged] = edge[0]
    mo.goal[wedged] = 0.03 * edge[1] - 0.02 * edge[2]
    mo.goal[stuck] = [0.01, -0.02, 0.03]
    fixed = [(wedged, edge[1], 0.03), (wedged, edge[2], -0.02)]
    fixed += [(stuck, axis, float(axis @ mo.goal[stuck])) for axis in np.eye(3)]
    fixed += [(i, mo.normal[i], a) for i, a in zip(touched, approach, strict=True)]
    fixed += [(i, axis, float(axis @ mo.v_star[i])) for i in held for axis in np.eye(3)]
    rows_into(mo.x, state.network.inverse_mass, rows)
    return state, fixed


@pytest.mark.parametrize("dense", [True, False], ids=["dense", "iterative"])
def test_the_multipliers_equal_the_full_saddle_point_solve(several, dense, monkeypatch):
    """Outside truth: mass, volumes, held nodes and touched nodes in one dense indefinite system."""
    if not dense:
        monkeypatch.setattr(rows_module, "DENSE_UP_TO", 0)
    dt = 1e-3
    state, fixed = touched_and_held(several, dt)
    mo, rows, n = state.motion, state.rows, several.node_count
    target = 1.001 * several.rest_volumes
    network = state.network._replace(longest_correction=np.inf)
    set_right_side(network, rows, mo, target, dt, 1e-13)
    tally = new_tally(1, 1)
    solve_multipliers(network, rows, mo, tally, Accuracy(1e-13, 2000))
    jacobian = np.zeros((several.kept.count, n, 3))
    for r in range(several.kept.count):
        entries = slice(rows.row_start[r], rows.row_start[r + 1])
        jacobian[r, rows.column[entries]] = rows.value[entries, :3]
    rectangle = np.vstack(
        [dt * jacobian.reshape(len(jacobian), -1), *[_single_row(n, i, axis) for i, axis, _ in fixed]]
    )
    right = np.concatenate([target - rows.volume, [velocity for _, _, velocity in fixed]])
    mass, empty = np.repeat(several.mass, 3), np.zeros((len(rectangle), len(rectangle)))
    system = np.block([[np.diag(mass), -rectangle.T], [rectangle, empty]])
    solution = np.linalg.lstsq(system, np.concatenate([mass * mo.v_star.ravel(), right]), rcond=1e-14)[0]
    lam = solution[3 * n : 3 * n + len(jacobian)]
    force = np.einsum("r,rja->ja", lam, jacobian)
    assert np.abs(mo.gradient - force).max() < 1e-6 * np.abs(force).max()
    if several.kept.count < n:  # pressures of nodes may hold a part that moves nothing
        assert np.abs(rows.lam - lam).max() < 1e-6 * np.abs(lam).max()
    motion_kernels.advance(mo, several.mass, network.inverse_mass, 1.0, dt, np.zeros((2, 3)))
    assert np.allclose(mo.v.ravel(), solution[: 3 * n], atol=1e-7)  # a millionth of the velocities of 0.1 m/s
    assert (tally.iterations[1] > 0) != dense


def test_an_iteration_ends_as_soon_as_a_residual_is_no_number(block_body, monkeypatch):
    monkeypatch.setattr(rows_module, "DENSE_UP_TO", 0)
    state, _ = touched_and_held(block_body.keeping(Volumes.nodal(block_body)), 1e-3)
    rows = state.rows
    diagonal_into(rows, state.motion, state.network.inverse_mass, rows.diagonal)
    rows.right[:], rows.right[7] = 1.0, np.nan
    count = solve_iteratively(rows, state.motion, state.network.inverse_mass, rows.lam, rows.allowed, 10**9)
    assert count <= 1 and np.isnan(rows.right).any()


@pytest.mark.parametrize("kind", ["hollow", "regions"])
def test_conjugate_directions_need_no_more_iterations_than_volumes(kind, block_body, hollow_body, monkeypatch):
    """Two for wall and lumen, seven for seven regions, and what is then left is round-off."""
    monkeypatch.setattr(rows_module, "DENSE_UP_TO", 0)
    body = hollow_body if kind == "hollow" else block_body.keeping(Volumes.regions(block_body, 7))
    state, _ = touched_and_held(body, 1e-3)
    rows = state.rows
    diagonal_into(rows, state.motion, state.network.inverse_mass, rows.diagonal)
    rows.right[:] = -np.random.default_rng(1).uniform(0.5, 1.0, body.kept.count)
    rows.allowed[:] = 1e-9  # the residuals start at 1; round-off of seven iterations is some 1e-14
    count = solve_iteratively(rows, state.motion, state.network.inverse_mass, rows.lam, rows.allowed, 100)
    assert 1 < count <= body.kept.count
    assert np.abs(rows.right).max() <= 1e-9


def _single_row(nodes: int, node: int, direction: np.ndarray) -> np.ndarray:
    """direction · v of one node as a row (3 n,)."""
    row = np.zeros((nodes, 3))
    row[node] = direction
    return row.ravel()


def test_the_whole_by_rows_is_the_whole_by_a_division(block_body):
    """A region that is everything, beside a second volume that nothing touches, has the pressure of the division."""
    clock = clock_for(block_body, 10, 20)
    planes = squeeze(block_body, 0.004, clock.duration)
    one = simulate(Setup(block_body, ImplicitVolume(), clock, planes, damping=20.0))
    setup = Setup(block_body, ImplicitVolume(), clock, planes, damping=20.0)
    state, pressures = replace(setup.start(), rows=volume_rows(Volumes.whole(block_body), block_body.node_count)), []
    for frame in range(clock.frames):
        state = setup.method.advance(state, setup.drive(frame))
        pressures.append(state.lam[0])
    assert np.allclose(pressures, one.pressure[:, 0], rtol=1e-9)
    assert np.abs(state.x - one.final).max() < 1e-12


@pytest.mark.parametrize("dense", [True, False], ids=["dense", "iterative"])
def test_every_volume_is_kept_under_contact(several, dense, monkeypatch):
    """Issue's number: |V_r/V0_r − 1| ≤ 1e-4 at the default time step, for every volume, through a 15 % squeeze."""
    if not dense:
        monkeypatch.setattr(rows_module, "DENSE_UP_TO", 0)
    depth = 0.075 * float(np.ptp(several.rest[:, 2]))
    clock = clock_for(several, 150, 20)
    setup = Setup(several, ImplicitVolume(), clock, squeeze(several, depth, 0.8 * clock.duration), damping=40.0)
    history = simulate(setup)
    assert history.outcome == "finished" and history.capped_steps == 0
    assert np.abs(history.contact_force[-1, :, 2]).min() > 0
    assert np.abs(history.volume / history.volume_target - 1).max() < 1e-4
    assert (history.iterations[:, 1].max() > 0) != dense


def test_filling_a_lumen_follows_its_ramp(hollow_body):
    """The lumen fills by 30 % while the wall keeps its volume; its pressure rises from none."""
    clock = clock_for(hollow_body, 100, 20)
    fill = Ramp((0.1 * clock.duration, 0.9 * clock.duration), (1.0, 1.3))
    history = simulate(Setup(hollow_body, ImplicitVolume(), clock, damping=40.0, targets={"lumen": fill}))
    factor = history.volume / hollow_body.rest_volumes
    assert np.abs(factor[:, 0] - 1).max() < 1e-4
    assert np.abs(factor[:, 1] / fill(history.t) - 1).max() < 1e-4
    assert factor[-1, 1] == pytest.approx(1.3, rel=1e-5)
    assert abs(history.pressure[5, 1]) < 1e-6 * history.pressure[-1, 1]


def test_a_jump_of_the_target_is_made_up_over_some_steps(hollow_body):
    """Within one step the target rises 2.5-fold, past the ramp that a set-up gives it: no node may move farther than
    the cap says, and all arrives."""
    clock = clock_for(hollow_body, 400, 1)
    setup = Setup(hollow_body, ImplicitVolume(), clock, damping=40.0)
    state, longest, capped = setup.start(), 0.0, 0
    jump = (hollow_body.rest_volumes * [1.0, 2.5])[None]
    cap = state.network.longest_correction
    for frame in range(60):
        before = state.x
        state = setup.method.advance(state, setup.drive(frame)._replace(volume_target=jump))
        longest = max(longest, float(np.linalg.norm(state.x - before, axis=1).max()))
        capped += int(state.tally.capped[0])
    assert capped > 1 and longest < 1.5 * cap
    factor = hollow_body.kept.measure(state.x) / hollow_body.rest_volumes
    assert np.abs(factor - [1.0, 2.5]).max() < 1e-3


@pytest.mark.parametrize("kind", ["block", "ball", *SEVERAL])
def test_a_crushed_body_comes_back(kind, request, block_body, hollow_body):
    """Shrunk to a thousandth the linear step would blow up (theory); with its cap the rest volume returns."""
    if kind in ("regions", "nodal"):
        body = block_body.keeping(Volumes.nodal(block_body) if kind == "nodal" else Volumes.regions(block_body, 7))
    else:
        body = request.getfixturevalue(f"{kind}_body")
    setup = Setup(body, ImplicitVolume(), clock_for(body, 400, 10, fraction=0.2), damping=60.0)
    state = setup.start()
    state.motion.x[:] = 1e-3 * body.rest
    capped = 0
    for frame in range(400):
        state = setup.method.advance(state, setup.drive(frame))
        capped += int(state.tally.capped[0])
    assert capped > 0
    assert np.abs(body.kept.measure(state.x) / body.rest_volumes - 1).max() < 1e-3


@pytest.mark.parametrize("dense", [True, False], ids=["dense", "iterative"])
def test_a_volume_held_by_its_nodes_is_left_alone(block_body, dense, monkeypatch):
    """All nodes of some cells are held: their volumes have nothing to push on, the others are kept."""
    if not dense:
        monkeypatch.setattr(rows_module, "DENSE_UP_TO", 0)
    body = block_body.keeping(Volumes.nodal(block_body))
    held = Attachment(np.flatnonzero(block_body.rest[:, 2] < 0.03))
    clock = clock_for(body, 20, 10)
    history = simulate(Setup(body, ImplicitVolume(), clock, (), (held,), (0.0, 0.0, -9.81), damping=30.0))
    assert history.outcome == "finished" and history.skipped_steps == 0
    assert np.abs(history.volume / body.rest_volumes - 1).max() < 1e-4
    assert (history.pressure == 0).any() and (history.pressure != 0).any()


def test_a_wrong_volume_that_nothing_can_push_is_counted(block_body):
    body = block_body.keeping(Volumes.regions(block_body, 7))
    setup = Setup(body, ImplicitVolume(), clock_for(body, 1, 3), attachments=(Attachment(np.arange(body.node_count)),))
    with pytest.warns(UserWarning, match="'region 2' moves faster"):
        setup = replace(setup, targets={"region 2": Ramp((0.0,), (1.1,))})
    history = simulate(setup)
    assert history.skipped_steps == 3 and history.capped_steps == 0


def test_more_volumes_come_closer_to_incompressible_everywhere(block_body):
    """What m is for: the local volume ratios of a squeezed block spread less with regions than with one volume."""
    clock = clock_for(block_body, 100, 20)
    planes = squeeze(block_body, 0.005, 0.5 * clock.duration)
    spread = []
    for volumes in (Volumes.whole(block_body), Volumes.regions(block_body, 12), Volumes.nodal(block_body)):
        setup = Setup(block_body.keeping(volumes), ImplicitVolume(), clock, planes, damping=40.0)
        after = np.empty(len(block_body.tetrahedra))
        tetrahedron_volumes_into(simulate(setup).final, block_body.tetrahedra, after)
        spread.append(float(np.std(after / block_body.tetrahedron_volumes)))
    assert spread[2] < 0.9 * spread[1] < 0.81 * spread[0]
