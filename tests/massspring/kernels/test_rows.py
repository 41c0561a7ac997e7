"""The rows of several volumes: sums four numbers at a time, areas of rings, entries that are each other's negative."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from massspring import Body, Volumes
from massspring.kernels.arrays.volume_rows import VolumeRows
from massspring.kernels.constraint.jacobian import diagonal_into, rows_into
from massspring.kernels.constraint.schur import apply_schur
from massspring.kernels.contact.modes import ON_EDGE, SLIDES, STICKS
from massspring.layout.allocate import start
from massspring.layout.jacobian_pattern import volume_rows
from massspring.layout.ring_areas import quadrangles
from massspring.run.precision import in_precision
from tests.massspring.conftest import icosphere
from tests.massspring.kernels.test_kernels import moved

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


def test_a_ring_takes_half_as_many_quadrangles_as_it_has_nodes():
    """⌈(k − 2)/2⌉ for each node of a sphere with k neighbours."""
    points, triangles = icosphere(1)
    rows = volume_rows(Volumes(("whole",), triangles, csr_array(np.ones((1, len(triangles))))), len(points))
    neighbours = np.bincount(triangles.ravel())
    counts = np.empty_like(neighbours)
    counts[rows.column[rows.target[:, 0]]] = np.diff(rows.ring_start.astype(np.int64))
    assert set(neighbours) == {5, 6} and np.array_equal(counts, (neighbours - 1) // 2)


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


def test_the_product_of_all_volumes_equals_dense_matrices(block_body):
    """S p against J W Jᵀ p written out, with nodes held and free of contact; nothing is left in the fourth numbers."""
    state = start(nodal(block_body))
    rows, n = state.rows, block_body.node_count
    assert rows is not None
    rows_into(moved(block_body), state.model.inverse_mass, rows)
    jacobian = dense(rows, n)
    matrix = np.einsum("rja,j,sja->rs", jacobian, state.model.inverse_mass, jacobian)
    p, product = np.random.default_rng(3).normal(size=n), np.empty(n)
    apply_schur(rows, state.contacts, state.model.inverse_mass, p, product)
    assert np.abs(product - matrix @ p).max() < MANY * np.abs(matrix).sum(axis=1).max() * np.abs(p).max()
    assert (rows.value[:, 3] == 0).all() and (rows.node_vector[:, 3] == 0).all()


def opposite_entries(rows: VolumeRows, body: Body) -> np.ndarray:
    """Pairs of entries of J that are each other's negative wherever the nodes are, (k, 2)."""
    rows_into(moved(body), np.ones(body.node_count), rows)
    value = rows.value[:, :3]
    apart = np.abs(value[:, None] + value).max(axis=2)
    return np.argwhere(np.triu(apart < MANY * 100 * np.abs(value).max()))


def test_volumes_inside_a_body_push_each_others_nodes_oppositely(block_body):
    """Each edge with a closed ring of tetrahedra spares one of its two entries; only opposite ones are spared."""
    body = nodal(block_body)
    rows = volume_rows(body.kept, body.node_count)
    pairs = np.array([(i, j) for i in range(4) for j in range(i + 1, 4)])
    edges = np.unique(np.sort(body.tetrahedra.astype(np.int64)[:, pairs].reshape(-1, 2), axis=1), axis=0)
    outer = np.sort(body.triangles.astype(np.int64)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    opposite = opposite_entries(rows, body)
    spared = np.sort(rows.target[rows.target[:, 2] != rows.target[:, 0]][:, [0, 2]], axis=1)
    assert len(rows.value) - len(rows.target) == len(spared) >= len(edges) - len(np.unique(outer, axis=0))
    assert {(p, q) for p, q in spared} <= {(p, q) for p, q in opposite}
    assert np.isin(opposite, spared).any(axis=1).all()  # of three that are alike one goes without


def test_any_numbers_of_volumes_spare_as_much(block_body):
    """Volumes of nodes in another order than the nodes', as in a run of a large body."""
    volumes = Volumes.nodal(block_body)
    mixed = np.random.default_rng(4).permutation(volumes.count)
    turned = Volumes(tuple(volumes.names[r] for r in mixed), volumes.triangles, volumes.share[mixed])
    n, x = block_body.node_count, moved(block_body)
    rows, other = volume_rows(volumes, n), volume_rows(turned, n)
    assert len(rows.target) == len(other.target)
    for each in (rows, other):
        rows_into(x, np.ones(n), each)
    assert np.abs(dense(other, n) - dense(rows, n)[mixed]).max() < MANY * np.abs(rows.value).max()


def test_two_volumes_that_meet_in_a_node_share_its_ring(block_body):
    """Entries of a node inside and of two regions, where no third one meets them, are summed once."""
    rows = volume_rows(Volumes.regions(block_body, 7), block_body.node_count)
    meeting = np.diff(rows.node_start.astype(np.int64))
    inside = np.setdiff1d(np.arange(block_body.node_count), block_body.surface_nodes)
    opposite = opposite_entries(rows, block_body)
    assert len(opposite) >= len(rows.value) - len(rows.target) >= (meeting[inside] == 2).sum() > 0
    assert np.array_equal(np.sort(np.unique(rows.target[:, [0, 2]])), np.arange(len(rows.value)))
