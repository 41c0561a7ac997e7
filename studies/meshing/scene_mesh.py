"""The mesh of a scene's organ, and the nodes of its held regions."""

import numpy as np

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.geometry import OrganMesh, fill, organ, read_mesh, scan
from studies.geometry.organs import SHAPES
from studies.geometry.shape.regions import Region, held_nodes
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.scene.organ_file import remeshed, scanned
from studies.scene.scene import Scene


def mesh_for(
    scene: Scene,
    nodes: int,
    filled: bool = True,
    layers: int | None = None,
    on_shape: bool = False,
    even: bool = False,
) -> OrganMesh:
    """The scene's organ with `nodes` surface nodes, the wall of a hollow one in `layers` (None: so many that elements
    are as high as they are long). Raises StudyError.

    A mesh file is used unchanged, unless its parameters ask for a new surface ("remesh", "smooth" or "wall"), whose
    flat sides enclose the volume of the file's, or with `on_shape` whose nodes are on it, for sides that will be
    curved. Nodes of organs are on the surface, denser where the shape is more curved, or `even`ly spread for
    references.
    """
    if lookup(scene.organ.shape, [*SHAPES, "file"], "organ") != "file":
        sides = None if even else "curved" if on_shape else "straight"
        given = scene.organ.parameters
        return organ(scene.organ.shape, nodes, scene.regions, filled, given, layers, sides=sides, cuts=scene.cuts)
    if scene.cuts:
        raise StudyError(f"scene '{scene.name}' cuts an organ of a file; only organs of the catalogue are cut so far")
    source, how = scanned(scene.organ, scene.name)
    if remeshed(scene.organ):
        return scan(source, nodes, fill=filled, layers=layers, regions=scene.regions, on_shape=on_shape, **how)
    mesh = read_mesh(source)
    return fill(mesh) if filled and not len(mesh.tetrahedra) else mesh


def patch_nodes(mesh: OrganMesh | QuadraticMesh, name: str, region: Region) -> np.ndarray:
    """Surface nodes of a patch: those of the patch of the mesher, or for a mesh from a file those inside the region."""
    if name in mesh.patches:
        return mesh.patches[name]
    return held_nodes(region, mesh.points[: mesh.surface_count])
