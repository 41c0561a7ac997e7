"""The sizes of a reference mesh that its order of convergence is in: away from outlines, and at them."""

from collections.abc import Sequence

import numpy as np
from skfem import MeshTet2

from reference_fem import facet_nodes, nodes
from reference_fem.model.problem import HeldNodes
from studies.geometry.mesh.organ_mesh import tetrahedron_facets
from studies.geometry.mesh.wall_layers import mean_edge
from studies.meshing.held_mesh import rim_sides
from studies.meshing.scene_mesh import mesh_for
from studies.scene.scene import Scene


def element_size(scene: Scene, level: float) -> float:
    """Mean edge [m] of the mesh `level` of the scene's plan before any elements are halved; of an octant the size.

    Halved elements are many and fill little room: the mean over all would hardly fall where the others shrink.
    Raises StudyError for a mesh that cannot be made.
    """
    if scene.symmetric:
        return level * float(scene.organ.parameters["radius"])
    mesh = mesh_for(scene, int(level), on_shape=True, even=True)
    return mean_edge(mesh.points, tetrahedron_facets(mesh.tetrahedra))


def outline_size(mesh: MeshTet2, held: Sequence[HeldNodes]) -> float:
    """Mean length [m] of the sides that leave the outlines of the held regions, NaN without one.

    It is measured, not counted from the times that elements are halved: to halve those at an outline at their longest
    sides, their neighbours must be halved too, and most of them lie at the outline as well.
    """
    table, on = facet_nodes(mesh), np.zeros(mesh.nvertices, dtype=bool)
    for region in held:
        on[rim_sides(table[np.isin(table, region.nodes).all(axis=1)])[:, :2]] = True
    leaving = np.asarray(mesh.edges)[:, on[mesh.edges].sum(axis=0) == 1]
    x = nodes(mesh)
    lengths = np.linalg.norm(x[leaving[0]] - x[leaving[1]], axis=1)
    return float(lengths.mean()) if len(lengths) else float("nan")
