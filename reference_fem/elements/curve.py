"""Curved second-order meshes."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from skfem import MeshTet, MeshTet2

from reference_fem.elements.shapes import facet_nodes, nodes


def curve(
    mesh: MeshTet, project: Callable[[np.ndarray], np.ndarray], on_surface: Callable[[np.ndarray], np.ndarray]
) -> MeshTet2:
    """A second-order mesh whose mid-side nodes on a surface lie on that surface.

    project: (3, N) points -> (3, N) points on the true surface [m].
    on_surface: (3, N) points -> bool (N,); a boundary facet is curved when its three vertices are on it.
    The vertices stay. Elements folded by the move are refused when the problem is set up.
    """
    curved = MeshTet2.from_mesh(mesh)
    points = nodes(mesh).T.copy()
    table = facet_nodes(mesh)
    chosen = np.asarray(on_surface(points), dtype=bool)[table[:, :3]].all(axis=1)
    middles = np.unique(table[chosen, 3:])
    points[:, middles] = project(points[:, middles])
    return replace(curved, doflocs=points)
