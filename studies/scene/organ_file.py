"""An organ from a mesh file or a scan: its parameters, and the options for its surface."""

from typing import Any

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.geometry.files.units import Source
from studies.scene.scene import Organ

SOURCE_PARAMETERS = ("path", "unit", "scale", "longest_side", "part")
"""Parameters for reading a file."""
MADE = ("smooth", "wall", "holes", "solid")
"""Operations on the surface before meshing, as in studies.geometry.api.scans.Remeshing."""
FILE_PARAMETERS = (*SOURCE_PARAMETERS, "sha256", "remesh", *MADE)
"""All parameters of the organ "file"."""


def scanned(organ: Organ, name: str) -> tuple[Source, dict[str, Any]]:
    """The file of an organ, and the options for its new surface; name: of the scene. Raises StudyError, also for a file
    that has changed since the scene was made."""
    parameters = organ.parameters
    for key in parameters:
        lookup(key, FILE_PARAMETERS, "parameter of an organ from a file")
    if "path" not in parameters or not {"unit", "longest_side"} & set(parameters):
        raise StudyError(f"scene '{name}': an organ from a file needs a path and a unit, it has {dict(parameters)}")
    source = Source(**{key: parameters[key] for key in SOURCE_PARAMETERS if key in parameters})
    if "sha256" in parameters and source.sha256 not in (None, parameters["sha256"]):
        raise StudyError(
            f"scene '{name}': {source.path.name} has changed since the scene was made; make the scene again"
        )
    return source, {key: parameters[key] for key in MADE if key in parameters}


def remeshed(organ: Organ) -> bool:
    """Whether the number of surface nodes can be chosen; a mesh file that is used unchanged has a fixed number."""
    parameters = organ.parameters
    return organ.shape != "file" or bool("smooth" in parameters or "wall" in parameters or parameters.get("remesh"))
