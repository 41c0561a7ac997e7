"""The rows of several volumes: sums four numbers at a time, areas of rings, entries that are each other's negative."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from massspring import Body, Volumes
from massspring.kernels.arrays.volume_rows import VolumeRows
from massspring.kernels.constraint.jacobian import diagonal_into, rows_into
from massspring.kernels.contact.node_contact import ON_EDGE, SLIDES, STICKS
from massspring.layout.allocate import start
from massspring.layout.jacobian_pattern import volume_rows
from massspring.layout.ring_areas import quadrangles
from massspring.run.precision import in_precision
from tests.massspring.kernels.forces.test_forces import moved

MANY = 1e-14
"""Round-off of a sum of some ten terms, over their size."""


def nodal(body: Body) -> Body:
    """`body` with one volume per node."""
    return body.keeping(Volumes.nodal(body))


def dense(rows: VolumeRows, nodes: int) -> np.ndarray:
    """J with its zeros, (m, n, 3), as the rows hold it; the copy node by node is the same."""
    by_row, by_node = np.zeros((2, len(rows.lam), nodes, 3))
    row = np.repeat(np.arange(len(rows.lam)), np.diff(rows.row_start.astype(np.int64)))
    by_row[row, rows.column] = rows.value[:, :3]
    node = np.repeat(np.arange(nodes), np.diff(rows.node_start.astype(np.int64)))
    by_node[rows.node_row, node] = rows.node_value[:, :3]
    assert np.array_equal(by_row, by_node)
    return by_row


def defined(volumes: Volumes, x: np.ndarray) -> np.ndarray:
    """J as eq. 8.2 says it, triangle by triangle, (m, n, 3)."""
    jacobian = np.zeros((volumes.count, len(x), 3))
    share = volumes.share.toarray()
    for f, triangle in enumerate(volumes.triangles.astype(np.int64)):
        a, b, c = x[triangle]
        jacobian[:, triangle] += share[:, f, None, None] / 6 * np.cross(b - a, c - a)
    return jacobian


FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
"""Of a tetrahedron, outward."""


def joined_tetrahedra(kind: str) -> Volumes:
    """One volume of two tetrahedra that meet in a node, in an edge, or in an edge with shares of their own."""
    first, second = np.array([0, 1, 2, 3]), np.array([0, 4, 5, 6] if kind == "node" else [0, 4, 5, 3])
    share = np.repeat([1.0, 0.3 if kind == "shares" else 1.0], 4)
    triangles = np.vstack([first[FACES], second[FACES]]).astype(np.uint32)
    return Volumes((kind,), triangles, csr_array(share[None]))


@pytest.mark.parametrize("kind", ["nodal", "regions", "hollow", "node", "edge", "shares"])
def test_rings_have_the_areas_of_their_triangles(kind, block_body, hollow_body):
    """Also where a node has two rings, which may meet or count differently."""
    body = hollow_body if kind == "hollow" else block_body
    several = {
        "nodal": Volumes.nodal,
        "regions": lambda body: Volumes.regions(body, 7),
        "hollow": lambda body: body.kept,
    }
    volumes = several[kind](body) if kind in several else joined_tetrahedra(kind)
    x = moved(body)
    rows = volume_rows(volumes, len(x))
    rows_into(x, np.ones(len(x)), rows)
    exact = defined(volumes, x)
    assert np.abs(dense(rows, len(x)) - exact).max() < 1e-13 * np.abs(exact).max()  # some ten products each


@pytest.mark.parametrize("seed", range(30))
def test_any_closed_chains_have_the_area_of_their_edges(seed):
    """Rounds over few nodes, which meet, cross and count differently: Σ u × v over the edges, in any order."""
    random = np.random.default_rng(seed)
    edges = np.array([(i, j) for i in range(7) for j in range(i + 1, 7)])
    x, chains = np.zeros((7, 4)), np.zeros((4, len(edges)))
    x[:, :3] = random.normal(size=(7, 3))
    for chain in chains:
        for share in (0.25, 0.25, 1.0):
            walk = random.permutation(7)[: random.integers(3, 8)]
            for i, j in zip(walk, np.roll(walk, -1), strict=True):
                chain[(edges == sorted((i, j))).all(axis=1)] += share if i < j else -share
    row, corner, share = quadrangles(csr_array(chains), edges)
    areas = np.zeros((4, 3))
    x, u, v = x[:, :3], *x[edges.T, :3]
    np.add.at(
        areas, row, share[:, None] * np.cross(x[corner[:, 2]] - x[corner[:, 0]], x[corner[:, 3]] - x[corner[:, 1]])
    )
    assert np.abs(areas - chains @ np.cross(u, v)).max() < 1e-13  # some forty products of size 1
    assert (np.diff(row) >= 0).all()


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_the_diagonal_knows_of_contact(block_body, precision):
    """Nodes that slide, lie on an edge or stick, one held; and a volume of which every node sticks."""
    state = in_precision(start(nodal(block_body)), precision)
    nodes, contacts, rows, weight = state.nodes, state.contacts, state.rows, state.model.inverse_mass
    assert rows is not None
    nodes.x[:] = moved(block_body)
    weight[12] = 0.0
    rows_into(nodes.x, weight, rows)
    jacobian = dense(rows, block_body.node_count)
    stuck = np.flatnonzero(np.abs(jacobian[0]).max(axis=1))
    axes = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    contacts.mode[[30, 31]], contacts.mode[35], contacts.mode[stuck] = SLIDES, ON_EDGE, STICKS
    contacts.direction[[30, 31, 35]] = axes
    mobile = weight[:, None, None] * np.eye(3)
    mobile[[30, 31]] -= weight[[30, 31], None, None] * axes[:2, :, None] * axes[:2, None, :]
    mobile[35], mobile[stuck] = weight[35] * np.outer(axes[2], axes[2]), 0.0
    exact = np.einsum("rja,jab,rjb->r", jacobian, mobile, jacobian)
    diagonal_into(rows, contacts, weight, rows.diagonal)
    assert np.abs(rows.diagonal - exact).max() < 10 * float(np.finfo(precision).eps) * exact.max()
    assert rows.diagonal[0] == 0.0 < rows.free_diagonal[0]
