"""The stiffness matrix of a body: minus the derivative of the forces by the node positions."""

import numpy as np
from scipy.sparse import coo_array, csr_array

from massspring.body.body import Body
from massspring.body.points import PointVolumes
from massspring.body.volumes import Volumes

AXIS = np.arange(3)


def blocks(rows: np.ndarray, columns: np.ndarray, values: np.ndarray, nodes: int) -> csr_array:
    """Σ of 3 × 3 blocks `values` (b, 3, 3) at node pairs `rows`, `columns` (b,), as a matrix (3n, 3n)."""
    row = 3 * rows.astype(np.int64)[:, None, None] + AXIS[:, None]
    column = 3 * columns.astype(np.int64)[:, None, None] + AXIS
    indices = (np.broadcast_to(row, values.shape).ravel(), np.broadcast_to(column, values.shape).ravel())
    return coo_array((values.ravel(), indices), shape=(3 * nodes, 3 * nodes)).tocsr()


def edge_blocks(ends: np.ndarray, block: np.ndarray, nodes: int) -> csr_array:
    """Σ_e of `block` (s, 3, 3) between the ends (s, 2) of springs: + on both nodes, − across, (3n, 3n)."""
    i, j = ends.T
    rows, columns = np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])
    return blocks(rows, columns, np.concatenate([block, block, -block, -block]), nodes)


def spring_stiffness(body: Body, x: np.ndarray) -> csr_array:
    """−∂f/∂x = Σ_e k [(1 − L/|d|) I + (L/|d|) d̂ d̂ᵀ] [N/m] at positions `x` (n, 3), (3n, 3n) (eq. 5.3)."""
    ends, springs = body.springs.ends, body.springs
    d = x[ends[:, 1]] - x[ends[:, 0]]
    square = np.einsum("ei,ei->e", d, d)
    share = springs.rest_length / np.sqrt(square)
    along = d[:, :, None] * d[:, None, :] / square[:, None, None]
    block = (1.0 - share)[:, None, None] * np.eye(3) + share[:, None, None] * along
    return edge_blocks(ends, springs.stiffness[:, None, None] * block, body.node_count)


def volume_hessian(triangles: np.ndarray, x: np.ndarray, share: np.ndarray | float = 1.0) -> csr_array:
    """∂²V/∂x² [m] of the volume inside closed `triangles` (f, 3) at `x` (n, 3) [m], symmetric, (3n, 3n).

    `share` (f,): how often each triangle counts.

    V = Σ x_i · (x_j × x_k)/6 is linear in each node: the block of i and j is −[x_k]×/6, from a node close by.
    """
    x = x - x.mean(axis=0)
    rows, columns, values = [], [], []
    for a in range(3):
        i, j, k = (triangles[:, (a + b) % 3] for b in range(3))
        block = np.zeros((len(triangles), 3, 3))
        block[:, [2, 0, 1], [1, 2, 0]] = -x[k] / 6.0
        block *= np.reshape(share, (-1, 1, 1))
        block -= block.transpose(0, 2, 1)
        rows += [i, j]
        columns += [j, i]
        values += [block, -block]
    return blocks(np.concatenate(rows), np.concatenate(columns), np.concatenate(values), len(x))


def membrane_stiffness(body: Body) -> csr_array:
    """Σ_t Σ_ab q_ab ∂Δ_a/∂x ∂Δ_b/∂x [N/m] of triangle springs at rest, (3n, 3n) (eq. 4.6)."""
    membrane, n = body.membrane, body.node_count
    corners = body.rest[membrane.triangles]
    edge = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    slope = np.zeros((len(edge), 3, 3, 3))  # of Δ_a by the position of corner b
    for a in range(3):
        slope[:, a, (a + 1) % 3], slope[:, a, (a + 2) % 3] = -2.0 * edge[:, a], 2.0 * edge[:, a]
    form = np.zeros((len(edge), 3, 3))
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        form[:, a, a] = membrane.stiffness[:, a]
        form[:, b, c] = form[:, c, b] = membrane.coupling[:, a]
    block = np.einsum("tapi,tab,tbqj->tpqij", slope, form, slope)
    rows = np.repeat(membrane.triangles, 3, axis=1).ravel()
    columns = np.tile(membrane.triangles, (1, 3)).ravel()
    return blocks(rows, columns, block.reshape(-1, 3, 3), n)


def point_hessian(volumes: PointVolumes, x: np.ndarray, pressure: np.ndarray) -> csr_array:
    """Σ_q p_q w_q ∂²J_q/∂x² [N/m] with `pressure` (k, 4) [Pa] at the points, at `x` (n, 3) [m], symmetric, (3n, 3n).

    J is linear in each column of F: the block of nodes a and b is −[F_q (∇N_a × ∇N_b)]×.
    """
    g = volumes.gradient
    turned = np.cross(g[:, :, :, None, :], g[:, :, None, :, :])
    vector = np.einsum("kq,kqij,kqabj->kabi", volumes.weight * pressure, volumes.deformation(x), turned)
    block = np.zeros((*vector.shape, 3))
    for i, j, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        block[..., i, j], block[..., j, i] = vector[..., c], -vector[..., c]
    return _element_blocks(volumes, block, len(x))


def local_stiffness(volumes: PointVolumes, bulk: float, x: np.ndarray) -> csr_array:
    """b Σ_q w_q ∂J_q/∂x ⊗ ∂J_q/∂x [N/m] of a pressure −b (J_q − 1) where J_q = 1, symmetric, (3n, 3n)."""
    area = volumes.areas(x)
    block = np.einsum("kq,kqai,kqbj->kabij", bulk / volumes.weight, area, area)
    return _element_blocks(volumes, block, len(x))


def _element_blocks(volumes: PointVolumes, block: np.ndarray, nodes: int) -> csr_array:
    """Σ over the elements of blocks (k, 10, 10, 3, 3) between their nodes."""
    cells = volumes.cells
    rows, columns = np.repeat(cells, 10, axis=1).ravel(), np.tile(cells, (1, 10)).ravel()
    return blocks(rows, columns, block.reshape(-1, 3, 3), nodes)


def stiffness_at_rest(body: Body) -> csr_array:
    """−∂f/∂x [N/m] of springs, triangle springs, rest pressure and the local pressure of points together at rest,
    (3n, 3n) (eq. 5.1, 5.3)."""
    springs = csr_array(spring_stiffness(body, body.rest) + membrane_stiffness(body))
    if isinstance(body.kept, PointVolumes):
        volumes = body.kept
        pressure = np.full(volumes.weight.shape, body.rest_pressure)
        local = local_stiffness(volumes, body.local_bulk, body.rest)
        return csr_array(springs + local - point_hessian(volumes, body.rest, pressure))
    if not body.rest_pressure:
        return springs
    whole = Volumes.whole(body)
    hessian = volume_hessian(whole.triangles, body.rest, whole.share.toarray()[0])
    return csr_array(springs - body.rest_pressure * hessian)
