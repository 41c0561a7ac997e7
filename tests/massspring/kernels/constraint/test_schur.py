"""The multipliers of several volumes at once: their rows, and their solves against dense ones."""

from dataclasses import replace

import numpy as np
import pytest

import massspring.layout.jacobian_pattern as rows_module
from massspring import Attachment, Body, Clock, ImplicitVolume, Setup, Volumes
from massspring.kernels.arrays.layout import Accuracy, Push
from massspring.kernels.constraint.jacobian import diagonal_into, rows_into, transposed_rows_times_into
from massspring.kernels.constraint.schur import solve_iteratively
from massspring.kernels.contact.node_contact import ON_EDGE, STICKS
from massspring.kernels.step.begin import open_frame
from massspring.kernels.step.end import advance
from massspring.layout.allocate import start
from massspring.layout.jacobian_pattern import volume_rows
from massspring.layout.state import new_diagnostics
from massspring.methods.implicit_volume import set_right_side, solve_multipliers
from tests.massspring.active_nodes import activate, list_active
from tests.massspring.kernels.forces.test_forces import ROUND_OFF, directional, moved


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
    """A state in motion, its rows filled: two nodes held, three sliding, one on an edge, one sticking.

    And what that fixes: (node, direction, velocity along it [m/s]).
    """
    random = np.random.default_rng(0)
    held, touched = np.array([5, 17]), np.array([20, 21, 30])
    state = start(body, (Attachment(held),), v=0.1 * random.normal(size=body.rest.shape))
    nodes, contacts, rows = state.nodes, state.contacts, state.rows
    nodes.v_star[:] = state.v
    nodes.v_star[held] = [0.02, 0.0, -0.01]
    approach = activate(contacts, touched, random)
    edge, on_edge, stuck = np.linalg.qr(random.normal(size=(3, 3)))[0], 31, 40
    contacts.contact_id[[on_edge, stuck]], contacts.second[on_edge] = 1, 2
    contacts.mode[[on_edge, stuck]] = ON_EDGE, STICKS
    list_active(contacts)
    contacts.direction[on_edge] = edge[0]
    contacts.v_target[on_edge] = 0.03 * edge[1] - 0.02 * edge[2]
    contacts.v_target[stuck] = [0.01, -0.02, 0.03]
    fixed = [(on_edge, edge[1], 0.03), (on_edge, edge[2], -0.02)]
    fixed += [(stuck, axis, float(axis @ contacts.v_target[stuck])) for axis in np.eye(3)]
    fixed += [(i, contacts.normal[i], a) for i, a in zip(touched, approach, strict=True)]
    fixed += [(i, axis, float(axis @ nodes.v_star[i])) for i in held for axis in np.eye(3)]
    rows_into(nodes.x, state.model.inverse_mass, rows)
    return state, fixed


@pytest.mark.parametrize("dense", [True, False], ids=["dense", "iterative"])
def test_the_multipliers_equal_the_full_saddle_point_solve(several, dense, monkeypatch):
    """Outside truth: mass, volumes, held nodes and touched nodes in one dense indefinite system."""
    if not dense:
        monkeypatch.setattr(rows_module, "DENSE_UP_TO", 0)
    dt = 1e-3
    state, fixed = touched_and_held(several, dt)
    nodes, contacts, rows, n = state.nodes, state.contacts, state.rows, several.node_count
    target = 1.001 * several.rest_volumes
    model = state.model._replace(correction_limit=np.inf)
    set_right_side(model, rows, nodes, contacts, target, dt, 1e-13)
    diagnostics = new_diagnostics(1, 1)
    solve_multipliers(model, rows, contacts, diagnostics, Accuracy(1e-13, 2000))
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
    solution = np.linalg.lstsq(system, np.concatenate([mass * nodes.v_star.ravel(), right]), rcond=1e-14)[0]
    lam = solution[3 * n : 3 * n + len(jacobian)]
    force = np.einsum("r,rja->ja", lam, jacobian)
    assert np.abs(rows.push - force).max() < 1e-6 * np.abs(force).max()
    if several.kept.count < n:  # pressures of nodes may hold a part that moves nothing
        assert np.abs(rows.lam - lam).max() < 1e-6 * np.abs(lam).max()
    boundary = Setup(several, ImplicitVolume(), Clock(dt, 1, 1)).boundary(0)
    open_frame(state.frame(boundary))
    advance(replace(state, diagnostics=new_diagnostics(2, 1)).frame(boundary), Push(rows.push, 1.0))
    assert np.allclose(nodes.v.ravel(), solution[: 3 * n], atol=1e-7)  # a millionth of the velocities of 0.1 m/s
    assert (diagnostics.iterations[1] > 0) != dense


def test_an_iteration_ends_as_soon_as_a_residual_is_no_number(block_body, monkeypatch):
    monkeypatch.setattr(rows_module, "DENSE_UP_TO", 0)
    state, _ = touched_and_held(block_body.keeping(Volumes.nodal(block_body)), 1e-3)
    rows = state.rows
    diagonal_into(rows, state.contacts, state.model.inverse_mass, rows.diagonal)
    rows.right[:], rows.right[7] = 1.0, np.nan
    count = solve_iteratively(rows, state.contacts, state.model.inverse_mass, rows.lam, rows.allowed, 10**9)
    assert count <= 1 and np.isnan(rows.right).any()


def _single_row(nodes: int, node: int, direction: np.ndarray) -> np.ndarray:
    """direction · v of one node as a row (3 n,)."""
    row = np.zeros((nodes, 3))
    row[node] = direction
    return row.ravel()
