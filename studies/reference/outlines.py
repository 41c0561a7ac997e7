"""Elements at the outline of a held region, shaped for the displacement there, which goes as √r from the outline."""

from dataclasses import replace

import numpy as np
from skfem import MeshTet2

from reference_fem import nodes
from reference_fem.elements.shapes import element_nodes
from studies.geometry.mesh.jacobian import smallest_jacobian

SHARE = 0.35
"""Where the middle of a side stands that leaves an outline, as a share of its length; ½ elsewhere. ¼ would hold √r
exactly (Barsoum, Int. J. Numer. Methods Eng. 10, 1976; for tetrahedra Nejati, Paluszny and Zimmerman, Eng. Fract. Mech.
144, 2015), and folds elements with curved sides."""
LEAST = 0.02
"""Smallest Jacobian that is left, over that of the straight element; three sides drawn leave 0.064 at the outline."""


def drawn_to_outlines(mesh: MeshTet2, outlines: np.ndarray) -> MeshTet2:
    """The mesh with the middles of all sides that have one end on `outlines`, vertices (v,), drawn towards it.

    The sides keep their curves. Elements that would come near folding keep the middles of all their sides.
    """
    on = np.zeros(mesh.nvertices, dtype=bool)
    on[outlines] = True
    ends = np.asarray(mesh.edges).T
    ends = np.where(on[ends[:, :1]], ends, ends[:, ::-1])
    drawn = np.concatenate([np.zeros(mesh.nvertices, dtype=bool), on[ends].sum(axis=1) == 1])
    plain, cells = nodes(mesh), element_nodes(mesh)
    near, far = plain[ends].transpose(1, 0, 2)
    middle = (1 - SHARE) * (1 - 2 * SHARE) * near + SHARE * (2 * SHARE - 1) * far
    moved = np.vstack([plain[: mesh.nvertices], middle + 4 * SHARE * (1 - SHARE) * plain[mesh.nvertices :]])
    while True:
        x = np.where(drawn[:, None], moved, plain)
        folded = cells[smallest_jacobian(x, cells) < LEAST]
        if not drawn[folded].any():
            return replace(mesh, doflocs=np.ascontiguousarray(x.T))
        drawn[folded] = False
