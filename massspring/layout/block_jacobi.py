"""Clusters of volumes and the inverse of S at rest in each, computed once before a run (eq. 8.7)."""

import numpy as np
from scipy.sparse import csr_array, diags_array

from massspring.kernels.arrays.volume_rows import SIZE, Clusters, VolumeRows
from massspring.kernels.constraint.jacobian import rows_into
from massspring.layout.sell_chunks import aligned

SHIFT = 1e-4
"""Added to the diagonal of 1, so that the inverse stays bounded, and within single precision, if volumes depend on each
other. The smallest eigenvalues for independent volumes are some hundredths."""


def each_alone(volumes: int) -> Clusters:
    """Clusters without coupling: the diagonal of S as preconditioner."""
    count = -(-volumes // SIZE)
    return _clusters(np.arange(volumes), [np.eye(min(SIZE, volumes - b * SIZE)) for b in range(count)])


def clusters_at_rest(rows: VolumeRows, rest: np.ndarray, inverse_mass: np.ndarray) -> Clusters:
    """Clusters of the volumes that are coupled most strongly at positions `rest` (n, 3) [m], and the inverse of S in
    each."""
    unit = _unit_matrix(rows, rest, inverse_mass)
    order = clustered(unit)
    cut = [order[first : first + SIZE] for first in range(0, len(order), SIZE)]
    shifted = [unit[own][:, own].toarray() + SHIFT * np.eye(len(own)) for own in cut]
    return _clusters(order, [np.linalg.inv(block) for block in shifted])


def clustered(unit: csr_array) -> np.ndarray:
    """An order of all volumes, (m,), in which every 64 form a cluster. A cluster begins with the volume least coupled
    to those left, and grows by the one most coupled to it; coupling is the square of the scaled S_rs in `unit` (m,
    m)."""
    pulls = unit.power(2)
    start, other, pull = pulls.indptr, pulls.indices, pulls.data
    loose, order = pulls.sum(axis=1), np.empty(unit.shape[0], dtype=np.int64)  # pyright: ignore[reportOptionalSubscript]
    for k in range(len(order)):
        if k % SIZE == 0:
            drawn = np.where(np.isinf(loose), -np.inf, 0.0)
            r = int(np.argmin(loose))
        else:
            r = int(np.argmax(drawn))
        order[k] = r
        around = slice(start[r], start[r + 1])
        drawn[other[around]] += pull[around]
        loose[other[around]] -= pull[around]
        drawn[r], loose[r] = -np.inf, np.inf
    return order


def _unit_matrix(rows: VolumeRows, rest: np.ndarray, inverse_mass: np.ndarray) -> csr_array:
    """S_rs/√(S_rr S_ss) [1] without contact, (m, m); a volume whose nodes are all held is not coupled and has a
    diagonal of 1."""
    rows_into(rest, inverse_mass, rows)
    m = len(rows.lam)
    at = 3 * rows.column[:, None].astype(np.int64) + np.arange(3)
    half = rows.value[:, :3] * np.sqrt(inverse_mass[rows.column])[:, None]
    root = csr_array((half.ravel(), at.ravel(), 3 * rows.row_start.astype(np.int64)), shape=(m, 3 * len(rest)))
    matrix = csr_array(root @ root.T)
    own = matrix.diagonal()
    per_root = diags_array(np.where(own > 0.0, 1.0 / np.sqrt(np.where(own > 0.0, own, 1.0)), 0.0))
    return csr_array(per_root @ matrix @ per_root + diags_array(np.where(own > 0.0, 0.0, 1.0)))


def _clusters(order: np.ndarray, inverses: list[np.ndarray]) -> Clusters:
    inverse = aligned((SIZE * len(inverses), SIZE), np.dtype(np.float32))
    for b, block in enumerate(inverses):
        inverse[b * SIZE : b * SIZE + len(block), : len(block)] = 0.5 * (block + block.T)
    part = aligned((2, SIZE), np.dtype(np.float32))
    return Clusters(order.astype(np.uint32), inverse, np.zeros(len(order)), part)
