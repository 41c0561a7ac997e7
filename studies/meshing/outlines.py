"""Shifts mid-side nodes next to the outline of a held region, where displacement varies as √r with the distance r from
it."""

import numpy as np
from skfem import MeshTet2


def drawn_middles(points: np.ndarray, mesh: MeshTet2, outlines: np.ndarray, share: float) -> np.ndarray:
    """Nodes at `points` (n, 3) [m] of a second-order mesh, with the middles of sides that have one end on `outlines`,
    vertices (v,), at `share` of the side from that end. Sides keep their curves; all other nodes do not move.

    A share of ¼ would represent √r exactly (Barsoum, Int. J. Numer. Methods Eng. 10, 1976; for tetrahedra Nejati,
    Paluszny and Zimmerman, Eng. Fract. Mech. 144, 2015), but it folds elements with curved sides.
    """
    on = np.zeros(mesh.nvertices, dtype=bool)
    on[outlines] = True
    ends = np.asarray(mesh.edges).T
    ends = np.where(on[ends[:, :1]], ends, ends[:, ::-1])
    leaving = on[ends].sum(axis=1) == 1
    near, far = points[ends].transpose(1, 0, 2)
    middle = (1 - share) * (1 - 2 * share) * near + share * (2 * share - 1) * far
    moved = middle + 4 * share * (1 - share) * points[mesh.nvertices :]
    middles = np.where(leaving[:, None], moved, points[mesh.nvertices :])
    return np.vstack([points[: mesh.nvertices], middles])
