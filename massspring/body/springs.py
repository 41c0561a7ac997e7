"""Springs: which nodes they join, and how stiff they are.

Kinds follow Jung, Hong, Choi 2005: *structural* springs on the mesh edges, *bending* springs between the two nodes
opposite a shared edge, *inner* springs from surface to axis; *solid* springs are the edges of a tetrahedral mesh.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

EDGES_OF_TRIANGLE = np.array([[0, 1], [1, 2], [2, 0]])
EDGES_OF_TETRAHEDRON = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


class SpringKind(IntEnum):
    """What a spring stands for; also its code in `Springs.kind`."""

    STRUCTURAL = 0
    BENDING = 1
    INNER = 2
    AXIAL = 3
    SOLID = 4


@dataclass(frozen=True, eq=False)
class Springs:
    """s springs."""

    ends: np.ndarray
    """Node indices, (s, 2) uint32."""
    rest_length: np.ndarray
    """[m], (s,)."""
    stiffness: np.ndarray
    """[N/m], (s,)."""
    kind: np.ndarray
    """`SpringKind` codes, (s,) uint8."""

    @property
    def count(self) -> int:
        """Number of springs."""
        return len(self.ends)


def unique_edges(cells: np.ndarray, local_edges: np.ndarray) -> np.ndarray:
    """Edges of `cells` (k, 3 or 4), each once with its smaller node first, (e, 2)."""
    edges = np.sort(cells[:, local_edges].reshape(-1, 2), axis=1)
    return np.unique(edges, axis=0)


def bending_pairs(triangles: np.ndarray) -> np.ndarray:
    """Nodes opposite each shared edge, (b, 2), without pairs that are mesh edges already."""
    edges = np.sort(triangles[:, EDGES_OF_TRIANGLE], axis=2).reshape(-1, 2)
    opposite = triangles[:, [2, 0, 1]].reshape(-1)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    pairs = np.sort(opposite[order].reshape(-1, 2), axis=1)
    pairs = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    structural = unique_edges(triangles, EDGES_OF_TRIANGLE)
    mesh_edges = set(map(tuple, structural.tolist()))
    return np.array([pair for pair in pairs.tolist() if tuple(pair) not in mesh_edges], dtype=pairs.dtype).reshape(
        -1, 2
    )


def lengths(points: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Distances [m] between the ends (s, 2) of springs on `points` (n, 3) [m], (s,)."""
    return np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1)


def matched_scale(shear_modulus: float, volume: float, weight: np.ndarray, length: np.ndarray) -> float:
    """Factor that turns relative stiffnesses `weight` (s,) into [N/m] so that Σ k L² = 15 V mu.

    Affine homogenisation of a network of central forces has lambda = mu = Σ k L²/(15 V) (docs/theory.md, eq. 4.1);
    matching mu is right for tissue that a volume constraint makes incompressible.
    """
    return 15.0 * volume * shear_modulus / float(weight @ length**2)
