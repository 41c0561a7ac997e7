"""The constraint Jacobian J = dV/dx of several volumes, and its preconditioner, as arrays."""

from typing import NamedTuple

import numpy as np

from massspring.kernels.jit.by_address import by_address

SIZE = 64
"""Volumes of a cluster. Smaller clusters need more iterations; larger inverses take longer to read than they save."""


@by_address
class Clusters(NamedTuple):
    """b clusters of the m volumes, each of strongly coupled volumes; the last cluster may be smaller."""

    order: np.ndarray
    """Volumes cluster by cluster, (m,) uint32."""
    inverse: np.ndarray
    """Inverse of S at rest in each cluster, scaled to a diagonal of 1; the columns of all clusters in turn, 0 beyond
    the volumes of a cluster, (64 b, 64) float32. It need not be exact."""
    scale: np.ndarray
    """1/√S_rr of the volumes in that order, 0 for what nothing can push [√(kg/m⁴)], (m,)."""
    part: np.ndarray
    """Scratch: scaled residual of a cluster, and its product with the inverse, (2, 64) float32."""


@by_address
class VolumeRows(NamedTuple):
    """m volumes: J = dV/dx as sparse rows with e entries, its transpose, and scratch."""

    target: np.ndarray
    """For each entry of J that is summed from areas: its index in `value` and in `node_value`, then both indices of the
    entry that is its negative (its own again if there is none), (c, 4) uint32."""
    ring_start: np.ndarray
    """First quadrangle in the ring of each summed entry, (c + 1,) uint32."""
    corner: np.ndarray
    """Nodes round a quadrangle, the last one the first again where it is a triangle, (q, 4) uint32."""
    corner_share: np.ndarray
    """s_rf / 6 [1], (q,)."""
    row_start: np.ndarray
    """First entry of each volume, (m + 1,) uint32."""
    column: np.ndarray
    """Node of each entry, (e,) uint32."""
    node_start: np.ndarray
    """First entry of each node in `node_entry` and `node_row`, (n + 1,) uint32."""
    node_entry: np.ndarray
    """Entries node by node, volumes ascending, (e,) uint32."""
    node_row: np.ndarray
    """Their volumes, (e,) uint32."""
    value: np.ndarray
    """J_rj [m²], (e, 4); the fourth number is 0 and fills a vector register."""
    node_value: np.ndarray
    """The same node by node, (e, 4)."""
    volume: np.ndarray
    """V_r [m³], (m,)."""
    lam: np.ndarray
    """Multipliers [Pa], (m,); on entry those of the last step."""
    push: np.ndarray
    """Jᵀ lam, the force of all volumes on each node [N], (n, 3)."""
    right: np.ndarray
    """Residual of the right-hand side with the current multipliers [m³/s²], (m,)."""
    free_diagonal: np.ndarray
    """S_rr without contact [m⁴/kg], (m,)."""
    diagonal: np.ndarray
    """S_rr [m⁴/kg], (m,)."""
    clusters: Clusters
    """Empty if S is solved densely."""
    matrix: np.ndarray
    """S [m⁴/kg], (m, m); (0, 0) where it is solved iteratively."""
    search: np.ndarray
    """(m,)."""
    image: np.ndarray
    """(m,)."""
    allowed: np.ndarray
    """Residual at which the iteration ends, (m,)."""
    node_vector: np.ndarray
    """(n, 4); the fourth number is 0."""
