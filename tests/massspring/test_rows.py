"""The rows of several volumes: products four numbers at a time, and entries that are each other's negative."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from massspring import Body, Volumes
from massspring.kernels.compiled import compiled
from massspring.kernels.lanes import sum_of_products, sum_of_scaled
from massspring.kernels.multipliers import apply_schur
from massspring.kernels.rows import rows_into
from massspring.methods.base import start
from massspring.methods.rows import volume_rows
from tests.massspring.test_kernels import moved

MANY = 1e-14
"""Round-off of a sum of some ten terms, over their size."""


@compiled
def scaled_sums(starts, index, value, factor, out):
    """What the plain function does, compiled."""
    for r in range(starts.shape[0] - 1):
        sum_of_scaled(starts[r], starts[r + 1], index, value, factor, out, r)


@compiled
def sums_of_products(starts, index, value, field, out):
    """What the plain function does, compiled."""
    for r in range(starts.shape[0] - 1):
        out[r] = sum_of_products(starts[r], starts[r + 1], index, value, field)


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_sums_in_registers_equal_the_plain_ones(real):
    """Rows of 0 to 6 entries, the last one up to the end of the arrays."""
    random = np.random.default_rng(1)
    starts = np.concatenate([[0], np.cumsum([3, 0, 6, 1, 4])]).astype(np.uint32)
    index = random.integers(0, 9, starts[-1]).astype(np.uint32)
    value, field = (random.normal(size=(size, 4)).astype(real) for size in (len(index), 9))
    factor = random.normal(size=9)
    out, plain = np.ones((5, 4), dtype=real), np.ones((5, 4), dtype=real)
    sums = np.ones(5)
    scaled_sums(starts, index, value, factor, out)
    sums_of_products(starts, index, value, field, sums)
    round_off = 10 * float(np.finfo(real).eps)
    matrix = csr_array((np.ones(len(index)), np.arange(len(index)), starts), shape=(5, len(index)))
    assert np.abs(out - matrix @ (factor[index, None] * value)).max() < round_off
    assert np.abs(sums - matrix @ (field[index] * value).sum(axis=1)).max() < round_off
    for r in range(5):
        sum_of_scaled(starts[r], starts[r + 1], index, value, factor, plain, r)
        assert sum_of_products(starts[r], starts[r + 1], index, value, field) == pytest.approx(sums[r], abs=round_off)
    assert np.abs(out - plain).max() < round_off


def nodal(body: Body) -> Body:
    """`body` with one volume per node."""
    return body.keeping(Volumes.nodal(body))


def test_the_product_of_all_volumes_equals_dense_matrices(block_body):
    """S p against J W Jᵀ p written out, with nodes held and free of contact; nothing is left in the fourth numbers."""
    state = start(nodal(block_body))
    rows, n = state.rows, block_body.node_count
    assert rows is not None
    rows_into(moved(block_body), rows)
    jacobian = np.zeros((n, n, 3))
    row = np.repeat(np.arange(n), np.diff(rows.row_start.astype(np.int64)))
    jacobian[row, rows.column] = rows.value[:, :3]
    matrix = np.einsum("rja,j,sja->rs", jacobian, state.network.inverse_mass, jacobian)
    p, product = np.random.default_rng(3).normal(size=n), np.empty(n)
    apply_schur(rows, state.motion, state.network.inverse_mass, p, product)
    assert np.abs(product - matrix @ p).max() < MANY * np.abs(matrix).sum(axis=1).max() * np.abs(p).max()
    assert (rows.value[:, 3] == 0).all() and (rows.node_vector[:, 3] == 0).all()


def test_volumes_inside_a_body_push_each_others_nodes_oppositely(block_body):
    """Each edge with a closed ring of tetrahedra, and no other, spares one of its two entries."""
    body = nodal(block_body)
    rows = volume_rows(body.kept, body.node_count)
    pairs = np.array([(i, j) for i in range(4) for j in range(i + 1, 4)])
    edges = np.unique(np.sort(body.tetrahedra.astype(np.int64)[:, pairs].reshape(-1, 2), axis=1), axis=0)
    outer = np.sort(body.triangles.astype(np.int64)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert len(rows.value) - len(rows.summed) == len(edges) - len(np.unique(outer, axis=0))
    assert (rows.twin != rows.summed).sum() == len(edges) - len(np.unique(outer, axis=0))


def test_volumes_that_are_no_nodes_spare_nothing(block_body):
    rows = volume_rows(Volumes.regions(block_body, 7), block_body.node_count)
    assert np.array_equal(rows.summed, np.arange(len(rows.value)))
    assert np.array_equal(rows.twin, rows.summed)
