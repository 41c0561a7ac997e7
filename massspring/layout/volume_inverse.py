"""An approximate S⁻¹ at rest of volumes over points, on two levels, once before a run (eq. 8.13)."""

import numpy as np
from scipy.sparse import block_diag, coo_array, csr_array, diags_array, eye_array

from massspring.body.points import PointVolumes
from massspring.kernels.points.arrays import NEAR_SIZE, Inverse
from massspring.layout.sell_chunks import aligned

SHIFT = 1e-6
"""Added to the diagonal of the scaled S, so that its inverse stays bounded if volumes depend on each other."""
NEGLIGIBLE = 0.02
"""Norm of a block below which it is left out, over the median norm of a diagonal block of S⁻¹. Of .01, .015, .02, .03
this or the last makes the shortest steps; with .03 a clamped ball takes half an iteration more."""
DENSE = 1000
"""Up to so many volumes all of S⁻¹ is dense: a measured step is then no longer than on two levels."""
SINGLE = np.dtype(np.float32)


def coarser(volumes: PointVolumes) -> csr_array:
    """P (m, c): each volume from one value per vertex and per closed surface. That of a vertex is its value, that of an
    element the mean of its vertices'. Of at most DENSE volumes each has its own."""
    if volumes.count <= DENSE:
        return csr_array(eye_array(volumes.count))
    vertex = np.unique(volumes.cells[:, :4], return_inverse=True)[1].reshape(-1, 4)
    rows, columns = volumes.corner_volume.ravel(), vertex.ravel()
    named = csr_array(coo_array((np.ones(rows.size), (rows, columns)), shape=(volumes.tissue_count, vertex.max() + 1)))
    mean = csr_array(diags_array(1.0 / named.sum(axis=1)) @ named)
    closed = volumes.count - volumes.tissue_count
    return csr_array(block_diag((mean, eye_array(closed)))) if closed else mean


def middles(volumes: PointVolumes, rest: np.ndarray) -> np.ndarray:
    """Where each volume is [m], (m, 3); a closed surface in the origin."""
    centre = rest[volumes.cells[:, :4]].mean(axis=1)
    rows = volumes.corner_volume.ravel()
    count = np.bincount(rows, minlength=volumes.count)
    sums = [np.bincount(rows, np.repeat(centre[:, axis], 4), volumes.count) for axis in range(3)]
    return np.stack(sums, axis=1) / np.maximum(count, 1)[:, None]


def inverse_at_rest(schur: csr_array | np.ndarray, coarse: csr_array, middle: np.ndarray) -> tuple[np.ndarray, Inverse]:
    """S_rr (m,) and B = P C Pᵀ + D^(−½) R D^(−½) ≈ S⁻¹ of a matrix S (m, m) with diagonal D.

    `coarse`: P (m, c); `middle`: where the volumes are [m], (m, 3). C is the least-squares fit to S⁻¹, and R the blocks
    of what it leaves out between clusters of near volumes. Smaller blocks are dropped, and what a row loses is added to
    its diagonal; B is positive definite. For a volume whose nodes are all held S_rr and D^(−½) are 0.
    """
    whole = schur if isinstance(schur, np.ndarray) else schur.toarray()
    diagonal = np.diag(whole).copy()
    able = diagonal > 0.0
    scale = np.where(able, 1.0 / np.sqrt(np.where(able, diagonal, 1.0)), 0.0)
    inverse = np.linalg.inv(scale[:, None] * whole * scale + np.diag(np.where(able, SHIFT, 1.0)))
    inverse = 0.5 * (inverse + inverse.T)
    p = csr_array(diags_array(np.sqrt(diagonal)) @ coarse)
    gram = np.linalg.pinv((p.T @ p).toarray(), hermitian=True)
    far = gram @ (p.T @ (p.T @ inverse).T) @ gram
    left = inverse - p @ (p @ far).T
    order = in_clusters(middle)
    near = _blocks(left[np.ix_(order, order)], inverse[np.ix_(order, order)])
    coarse_scale = np.sqrt(np.maximum(np.diag(far), 0.0))
    per_scale = np.divide(1.0, coarse_scale, out=np.zeros_like(coarse_scale), where=coarse_scale > 0.0)
    clusters = -(-len(order) // NEAR_SIZE)
    return diagonal, Inverse(
        coarse_start=coarse.indptr.astype(np.uint32),
        coarse=coarse.indices.astype(np.uint32),
        weight=np.where(np.repeat(able, np.diff(coarse.indptr)), coarse.data, 0.0),
        far=_single(per_scale[:, None] * far * per_scale),
        coarse_scale=coarse_scale,
        scale=scale,
        order=order.astype(np.uint32),
        **near,
        moment=np.zeros(len(far)),
        scaled=aligned((len(far),), SINGLE),
        part=aligned((clusters + 1, NEAR_SIZE), SINGLE),
    )


def in_clusters(middle: np.ndarray) -> np.ndarray:
    """An order of volumes at `middle` (m, 3) in which every NEAR_SIZE are near each other, (m,): their box is halved
    along its longest side, and so on."""

    def halved(those: np.ndarray) -> np.ndarray:
        if len(those) <= NEAR_SIZE:
            return those
        along = np.ptp(middle[those], axis=0).argmax()
        those = those[np.argsort(middle[those, along], kind="stable")]
        half = -(-len(those) // NEAR_SIZE) // 2 * NEAR_SIZE
        return np.concatenate([halved(those[:half]), halved(those[half:])])

    return halved(np.arange(len(middle)))


def _blocks(left: np.ndarray, inverse: np.ndarray) -> dict[str, np.ndarray]:
    """The blocks between clusters of what is `left` of the `inverse`, both (m, m) in the order of the clusters."""
    bound = NEGLIGIBLE * np.median(_norms(inverse).diagonal())
    norms = _norms(left)
    while True:
        keep = np.maximum(norms, norms.T) >= bound
        keep |= np.diag(keep.any(axis=1))
        within = np.kron(keep, np.ones((NEAR_SIZE, NEAR_SIZE), dtype=bool))[: len(left), : len(left)]
        dropped = np.where(within, 0.0, left)
        lift = np.diag(np.sqrt((dropped * dropped).sum(axis=1)))
        if not dropped.any() or _is_definite(inverse - dropped + lift):
            break
        bound *= 0.5
    cluster, other = np.nonzero(keep)
    start = np.concatenate([[0], np.cumsum(keep.sum(axis=1))])
    return {
        "near_start": start.astype(np.uint32),
        "near_cluster": other.astype(np.uint32),
        "near": _single(_tiles(left - dropped + lift)[other, cluster].reshape(-1, NEAR_SIZE)),
    }


def _tiles(matrix: np.ndarray) -> np.ndarray:
    """A matrix (m, m) in blocks of clusters, 0 beyond it, (b, b, NEAR_SIZE, NEAR_SIZE)."""
    count = -(-len(matrix) // NEAR_SIZE)
    filled = np.pad(matrix, (0, count * NEAR_SIZE - len(matrix)))
    return filled.reshape(count, NEAR_SIZE, count, NEAR_SIZE).transpose(0, 2, 1, 3)


def _norms(matrix: np.ndarray) -> np.ndarray:
    """Of the blocks of a matrix, (b, b)."""
    return np.sqrt((_tiles(matrix) ** 2).sum(axis=(2, 3)))


def _is_definite(matrix: np.ndarray) -> bool:
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return False
    return True


def _single(table: np.ndarray) -> np.ndarray:
    """In single precision, on a cache line."""
    single = aligned(table.shape, SINGLE)
    single[:] = table
    return single
