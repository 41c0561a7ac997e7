"""The league of engines: a frozen set of scenes, and entries by file that are judged on it.

The set has five open scenes and three that are held back, with the hashes of their meshes and references; a reference
that changes needs a new set. An entry is a JSON file that describes program, machine and settings, next to its result.
"""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from studies.base.errors import StudyError
from studies.exchange.meshes import GivenMesh, given_mesh
from studies.metrics.metrics import METRICS
from studies.scene.scene import Scene

SET = "OB-2027.1"
FILE = Path(__file__).parent / f"{SET}.json"
LEAGUE = "league"
"""Folder of the results with what is entered, the table and the chart; attribute of a record: the entry as JSON."""
HANDED = {"metrics", "errors", *(metric.name for metric in METRICS)}
"""Names under which metrics would be handed in: they are computed here."""


@dataclass(frozen=True)
class FrozenScene:
    """A scene of the set."""

    reference: str
    """SHA-256 of the file of its reference; empty for one that is held back and not solved yet."""
    physics: str
    """SHA-256 of what that depends on (studies.reference.published)."""
    meshes: dict[str, str]
    """ "straight-150" -> GivenMesh.digest."""
    bars: dict[str, float]
    """Uncertainty of its reference [%] by metric, of the pairs of scene and quantity that are judged."""
    held_back: bool


@cache
def frozen(file: Path = FILE) -> dict[str, FrozenScene]:
    """The scenes of the set by name, the open ones first. Raises StudyError where its file cannot be read."""
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        return {
            name: FrozenScene(one["reference"], one["physics"], one["meshes"], one.get("bars", {}), held_back)
            for held_back, part in ((False, "open"), (True, "held back"))
            for name, one in data[part].items()
        }
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise StudyError(f"the frozen set {file.name} cannot be read ({error}); install organbench again") from error


class EntryFile(BaseModel):
    """The description of an entry in its JSON file."""

    model_config = ConfigDict(extra="forbid", strict=True)

    set: str
    scene: str
    engine: str
    version: str
    mesh: str
    """"straight" or "curved"."""
    nodes: int
    """Vertices on the outer surface with which the scene was exported."""
    mesh_sha256: str
    """As in scene.json."""
    result: str = ""
    """File name of the positions, next to the JSON file; or one of the next two in its place."""
    skipped: str = ""
    """Why the program cannot do the scene."""
    failed: str = ""
    """How the program broke off."""
    seconds: float | None = None
    """Computing time for a simulated second [s/s]."""
    evaluations: int | None = Field(default=None, gt=0)
    """How often the forces of all elements were evaluated in the whole run."""
    settings: dict[str, Any] = {}
    environment: dict[str, Any]
    """Python, machine, packages, or another environment of the engine."""
    command: str
    """By which it was computed."""
    ours: bool = False
    """Of the authors of organbench."""


def read_entry_file(path: Path) -> EntryFile:
    """The entry in a file. Raises StudyError for one that cannot be read, that lacks or adds something, and for one
    that hands in metrics."""
    if not path.is_file():
        raise StudyError(f"there is no file {path}")
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise StudyError(f"{path.name} cannot be read as an entry ({error})") from error
    if not isinstance(data, dict):
        raise StudyError(f"{path.name} holds no JSON object; docs/league.md lists what an entry needs")
    metrics = sorted(HANDED & set(data))
    if metrics:
        raise StudyError(f"{path.name} hands in {', '.join(metrics)}: metrics are computed here; leave them out")
    try:
        entry = EntryFile.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise StudyError(f"{path.name}: {where}: {first['msg'].lower()}; docs/league.md lists what it needs") from error
    if [bool(entry.result), bool(entry.skipped), bool(entry.failed)].count(True) != 1:
        raise StudyError(
            f"{path.name} needs one of result, skipped and failed: a file of positions, or why there is none"
        )
    if Path(entry.result).name != entry.result:
        raise StudyError(f"the result {entry.result!r} of the entry must lie next to its JSON file; give its file name")
    return entry


def check_entry(entry: EntryFile, scene: str) -> None:
    """Raises StudyError for an entry of another set or scene, one of a scene that is held back, and one on a mesh that
    is none of the set."""
    if entry.set != SET:
        raise StudyError(f"the entry is of set {entry.set}; this version judges {SET}: export the scene again")
    if entry.scene != scene:
        raise StudyError(f"the entry is of {entry.scene}, not of {scene}")
    if scene not in frozen():
        raise StudyError(f"{scene} is not in {SET}, which has {', '.join(frozen())}")
    if frozen()[scene].held_back:
        raise StudyError(f"{scene} of {SET} is held back: nobody can enter it before its data is published")
    key, meshes = f"{entry.mesh}-{entry.nodes}", frozen()[scene].meshes
    if key not in meshes:
        raise StudyError(f"the mesh of the entry ({key}) is not one of {SET}, which has {', '.join(meshes)} of {scene}")
    if meshes[key] != entry.mesh_sha256:
        raise StudyError(
            f"mesh_sha256 of the entry is not that of {key} of {scene} in {SET}; compute on the exported mesh "
            "and copy its SHA-256 from scene.json"
        )


def mesh_of_entry(entry: EntryFile, scene: Scene) -> GivenMesh:
    """Raises StudyError where this machine makes another mesh than that of the set, on which nothing can be judged."""
    mesh = given_mesh(scene, entry.nodes, entry.mesh)
    if mesh.digest != entry.mesh_sha256:
        raise StudyError(
            f"gmsh makes another mesh here than that of {SET} ({entry.scene}, {entry.mesh}-{entry.nodes}); "
            "install the versions in constraints.txt"
        )
    return mesh
