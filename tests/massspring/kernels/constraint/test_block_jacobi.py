"""The preconditioner of many volumes: what it is, what it leaves out, and what it saves."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Attachment, Body, ImplicitVolume, Volumes
from massspring.kernels.arrays.volume_rows import SIZE
from massspring.kernels.constraint.block_jacobi import precondition_into, scale_into
from massspring.kernels.constraint.jacobian import diagonal_into, rows_into
from massspring.kernels.constraint.schur import solve_iteratively
from massspring.layout.allocate import start
from massspring.layout.block_jacobi import SHIFT, clusters_at_rest, each_alone
from massspring.layout.state import State
from tests.massspring.kernels.constraint.test_jacobian import dense
from tests.massspring.kernels.forces.test_forces import moved

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
