"""Multipliers of many volumes: the dense and the iterative solve, and the preconditioner of the latter."""

from dataclasses import replace

import numpy as np
import pytest

import massspring.layout.jacobian_pattern as rows_module
from massspring import Attachment, Body, Clock, ImplicitVolume, Setup, Volumes
from massspring.kernels.arrays.layout import Accuracy, Push
from massspring.kernels.arrays.volume_rows import SIZE
from massspring.kernels.constraint.block_jacobi import precondition_into, scale_into
from massspring.kernels.constraint.jacobian import diagonal_into, rows_into, transposed_rows_times_into
from massspring.kernels.constraint.schur import solve_iteratively
from massspring.kernels.contact.node_contact import ON_EDGE, STICKS
from massspring.kernels.step.begin import open_frame
from massspring.kernels.step.end import advance
from massspring.layout.allocate import start
from massspring.layout.block_jacobi import SHIFT, clusters_at_rest, each_alone
from massspring.layout.jacobian_pattern import volume_rows
from massspring.layout.state import State, new_diagnostics
from massspring.methods.implicit_volume import set_right_side, solve_multipliers
from tests.massspring.conftest import activate, list_active
from tests.massspring.kernels.constraint.test_jacobian import dense
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


SINGLE = 1e-5
"""Round-off of 64 products in single precision with an inverse whose condition is a hundred."""


@pytest.fixture(scope="module")
def kept(filled_ball: Body) -> tuple[State, np.ndarray]:
    """A body at rest with one volume per node, two nodes held, and S as a dense matrix."""
    body = filled_ball.keeping(Volumes.nodal(filled_ball))
    state = start(body, (Attachment(np.array([5, 17])),))
    rows, weight = state.rows, state.model.inverse_mass
    assert rows is not None and body.node_count > SIZE and body.node_count % SIZE  # more than one, one not full
    state = replace(state, rows=rows._replace(clusters=clusters_at_rest(rows, body.rest, weight)))
    jacobian = dense(rows, body.node_count)
    diagonal_into(rows, state.contacts, weight, rows.diagonal)
    return state, np.einsum("rja,j,sja->rs", jacobian, weight, jacobian)


def test_it_is_the_inverse_within_clusters(kept):
    """z against dense inverses, also where today's diagonal is another; its product with r is what comes back."""
    state, matrix = kept
    clusters, m = state.rows.clusters, len(matrix)
    order = clusters.order.astype(np.int64)
    assert np.array_equal(np.sort(order), np.arange(m))
    random = np.random.default_rng(0)
    grown = random.uniform(0.5, 2.0, m)
    root = np.sqrt(np.diag(matrix))
    unit, exact = matrix / np.outer(root, root), np.zeros((m, m))
    for first in range(0, m, SIZE):
        own = np.ix_(order[first : first + SIZE], order[first : first + SIZE])
        exact[own] = np.linalg.inv(unit[own] + SHIFT * np.eye(len(own[0])))
    exact /= np.outer(root * grown, root * grown)
    scale_into(clusters, np.diag(matrix) * grown**2)
    residual, z = random.normal(size=m) * root, np.empty(m)
    rho = precondition_into(clusters, residual, z)
    assert np.abs((z - exact @ residual) * root).max() < SINGLE * np.abs((exact @ residual) * root).max()
    assert rho == pytest.approx(residual @ z, rel=1e-12)


def test_volumes_without_a_node_to_push_are_left_out(filled_ball):
    """All nodes of a volume held: no row of the inverse is infinite, and its pressure stays what it is."""
    body = filled_ball.keeping(Volumes.nodal(filled_ball))
    cells = body.tetrahedra[(body.tetrahedra == 9).any(axis=1)]
    state = ImplicitVolume().start(body, (Attachment(np.unique(cells).astype(np.int64)),))
    rows = state.rows
    assert rows is not None and np.isfinite(rows.clusters.inverse).all()
    diagonal_into(rows, state.contacts, state.model.inverse_mass, rows.diagonal)
    assert rows.diagonal[9] == 0.0
    rows.right[:], rows.allowed[:], rows.lam[:] = 1.0, 1e-6, 3.0
    count = solve_iteratively(rows, state.contacts, state.model.inverse_mass, rows.lam, rows.allowed, 200)
    assert 0 < count < 200 and rows.lam[9] == 3.0 and np.isfinite(rows.lam).all()


@pytest.mark.parametrize("bent", [False, True])
def test_it_saves_iterations(kept, filled_ball, bent):
    """Against the diagonal, at rest and with the body bent: both end at the multipliers of a dense solve."""
    state, matrix = kept
    rows, weight, m = state.rows, state.model.inverse_mass, len(matrix)
    x = moved(filled_ball) if bent else filled_ball.rest
    rows_into(x, weight, rows)
    jacobian = dense(rows, len(x))
    today = np.einsum("rja,j,sja->rs", jacobian, weight, jacobian)
    diagonal_into(rows, state.contacts, weight, rows.diagonal)
    solution = np.random.default_rng(4).normal(size=m)
    right, counts = today @ solution, []
    for clusters in (rows.clusters, each_alone(m)):
        trial = rows._replace(clusters=clusters, lam=np.zeros(m))
        trial.right[:], trial.allowed[:] = right, 1e-6 * np.abs(right).max()
        counts.append(solve_iteratively(trial, state.contacts, weight, trial.lam, trial.allowed, 500))
        left = np.abs(right - today @ trial.lam).max()
        assert left < 1.01e-6 * np.abs(right).max()  # the recursive residual and the true one differ by round-off
    assert counts[0] < 0.8 * counts[1]
