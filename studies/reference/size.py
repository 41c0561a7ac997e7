"""The size of a reference mesh that its order of convergence is in."""

from studies.geometry.mesh.organ_mesh import tetrahedron_facets
from studies.geometry.mesh.wall_layers import mean_edge
from studies.scene.meshing import mesh_for
from studies.scene.scene import Scene


def element_size(scene: Scene, level: float) -> float:
    """Mean edge [m] of the mesh `level` of the scene's plan before any elements are halved; of an octant the size.

    Halved elements are many and fill little room: the mean over all would hardly fall where the others shrink.
    Raises StudyError for a mesh that cannot be made.
    """
    if scene.symmetric:
        return level * float(scene.organ.parameters["radius"])
    mesh = mesh_for(scene, int(level))
    return mean_edge(mesh.points, tetrahedron_facets(mesh.tetrahedra))
