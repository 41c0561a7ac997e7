"""Springs without length of linear tetrahedra whose deformation is smoothed over the cells round an edge or a face.

Liu, Nguyen-Thoi (2010), Smoothed finite element methods: with F̃_s = Σ_t (V_t/ν) F_t/V_s in the domain s of an edge
(ν = 6 domains a cell) or of a face (ν = 4), ½ mu Σ_s V_s |F̃_s|² = ½ mu xᵀ K̃ x with a constant K̃ between all nodes of
the cells of a domain (docs/theory.md, eq. 4.11). Softer than linear elements: with one volume per node the error of the
force is about halved, and the stable step is longer.
"""

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array, diags_array, triu

from massspring.body.laws import Edges
from massspring.body.springs import EDGES_OF_TETRAHEDRON

FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
Smoothed = Callable[[Edges, float], tuple[np.ndarray, np.ndarray]]


def edge_smoothed(edges: Edges, mu: float) -> tuple[np.ndarray, np.ndarray]:
    """Ends (s, 2) and k_ij = −mu K̃_ij [N/m], (s,): deformation smoothed over the cells round each edge (eq. 4.11)."""
    return _springs(edges, mu, EDGES_OF_TETRAHEDRON)


def face_smoothed(edges: Edges, mu: float) -> tuple[np.ndarray, np.ndarray]:
    """Ends (s, 2) and k_ij = −mu K̃_ij [N/m], (s,): deformation smoothed over the two cells at each face (eq. 4.11)."""
    return _springs(edges, mu, FACES)


def _springs(edges: Edges, mu: float, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of domains at the `sides` (ν, 2 or 3) of the cells."""
    cells, nodes = edges.tetrahedra, len(edges.points)
    named = np.sort(cells[:, sides].reshape(len(cells) * len(sides), -1), axis=1)
    _, domain = np.unique(named, axis=0, return_inverse=True)
    domain = domain.reshape(len(cells), len(sides))
    share = edges.volumes / len(sides)
    volume = np.bincount(domain.ravel(), weights=np.repeat(share, len(sides)))
    slopes = share[:, None, None] * edges.gradients()
    rows = np.repeat(domain, 4, axis=1).ravel()
    columns = np.tile(cells.astype(np.int64), (1, len(sides))).ravel()
    stiffness = csr_array((nodes, nodes))
    for axis in range(3):
        entry = np.tile(slopes[:, :, axis], (1, len(sides))).ravel()
        smoothed = csr_array((entry, (rows, columns)), shape=(len(volume), nodes))
        stiffness = stiffness + smoothed.T @ diags_array(1.0 / volume) @ smoothed
    upper = triu(stiffness, 1).tocoo()
    order = np.lexsort((upper.col, upper.row))
    return np.column_stack([upper.row, upper.col])[order], -mu * upper.data[order]


SMOOTHED: dict[str, Smoothed] = {law.__name__: law for law in (edge_smoothed, face_smoothed)}
"""Laws with more springs than the mesh has edges."""
