"""The mesh of a scene's organ, and the nodes of its held regions."""

from typing import Any

import numpy as np

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.geometry import OrganMesh, fill, organ, read_mesh, scan
from studies.geometry.files.units import Source
from studies.geometry.organs import SHAPES
from studies.scene.scene import Organ, Scene

SOURCE_PARAMETERS = ("path", "unit", "scale", "longest_side", "part")
"""How a file is to be taken."""
MADE = ("smooth", "wall", "holes", "solid")
"""What is done to a surface on its way to a body, as in studies.geometry.api.scans.Remeshing."""
FILE_PARAMETERS = (*SOURCE_PARAMETERS, "sha256", "remesh", *MADE)
"""Of the organ "file"."""


def mesh_for(
    scene: Scene,
    nodes: int,
    filled: bool = True,
    layers: int | None = None,
    on_shape: bool = False,
    even: bool = False,
) -> OrganMesh:
    """The scene's organ with `nodes` surface nodes, the wall of a hollow one in `layers` (None: as many as make their
    elements as high as long). Raises StudyError.

    A mesh file comes as it is, unless its parameters ask for a new surface: "remesh": true, or "smooth" or "wall" [m].
    The flat sides of that enclose the volume of the file's surface, or its nodes are `on_shape`, for sides that will be
    curved; nodes of all other organs always are. Nodes lie where the sides need them to follow the shape; those of
    references are `even`, for these are halved until the shape is met.
    """
    if lookup(scene.organ.shape, [*SHAPES, "file"], "organ") != "file":
        sides = None if even else "curved" if on_shape else "straight"
        return organ(scene.organ.shape, nodes, scene.regions, filled, scene.organ.parameters, layers, sides=sides)
    source, how = scanned(scene.organ, scene.name)
    if remeshed(scene.organ):
        return scan(source, nodes, fill=filled, layers=layers, regions=scene.regions, on_shape=on_shape, **how)
    mesh = read_mesh(source)
    return fill(mesh) if filled and not len(mesh.tetrahedra) else mesh


def scanned(organ: Organ, name: str) -> tuple[Source, dict[str, Any]]:
    """The file of an organ, and what is asked of its new surface; name: of the scene. Raises StudyError, also for a
    file that holds something else than when the scene was made."""
    parameters = organ.parameters
    for key in parameters:
        lookup(key, FILE_PARAMETERS, "parameter of an organ from a file")
    if "path" not in parameters or not {"unit", "longest_side"} & set(parameters):
        raise StudyError(f"scene '{name}': an organ from a file needs a path and a unit, it has {dict(parameters)}")
    source = Source(**{key: parameters[key] for key in SOURCE_PARAMETERS if key in parameters})
    if "sha256" in parameters and source.sha256 not in (None, parameters["sha256"]):
        raise StudyError(
            f"scene '{name}': {source.path.name} does not hold what it held when the scene was made; make it anew"
        )
    return source, {key: parameters[key] for key in MADE if key in parameters}


def remeshed(organ: Organ) -> bool:
    """Whether the number of surface nodes is free: a mesh file that comes as it is has its own."""
    parameters = organ.parameters
    return organ.shape != "file" or bool("smooth" in parameters or "wall" in parameters or parameters.get("remesh"))


def patch_nodes(mesh: OrganMesh, name: str, region: object) -> np.ndarray:
    """Surface nodes of a patch: as the mesher outlined it, or for a mesh from a file those inside the region."""
    if name in mesh.patches:
        return mesh.patches[name]
    return np.flatnonzero(region.level(mesh.points[: mesh.surface_count]) <= 0)  # pyright: ignore[reportAttributeAccessIssue]
