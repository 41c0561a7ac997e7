"""Elements of a reference at the outline of a held region, their middles drawn to it (studies.meshing.outlines)."""

from dataclasses import replace

import numpy as np
from skfem import MeshTet2

from reference_fem import nodes
from reference_fem.elements.shapes import element_nodes
from studies.geometry.mesh.jacobian import smallest_jacobian
from studies.meshing.outlines import drawn_middles

SHARE = 0.35
"""Where the middle of a side stands that leaves an outline, as a share of its length; ½ elsewhere."""
LEAST = 0.02
"""Smallest Jacobian that is left, over that of the straight element; three sides drawn leave 0.064 at the outline."""


def drawn_to_outlines(mesh: MeshTet2, outlines: np.ndarray) -> MeshTet2:
    """The mesh with the middles of all sides that have one end on `outlines`, vertices (v,), drawn towards it.

    Elements that would come near folding keep the middles of all their sides.
    """
    plain, cells = nodes(mesh), element_nodes(mesh)
    moved, kept = drawn_middles(plain, mesh, outlines, SHARE), np.zeros(len(plain), dtype=bool)
    while True:
        x = np.where(kept[:, None], plain, moved)
        folded = cells[smallest_jacobian(x, cells) < LEAST]
        if kept[folded].all():
            return replace(mesh, doflocs=np.ascontiguousarray(x.T))
        kept[folded] = True
