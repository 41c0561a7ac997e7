"""An entry by file: a JSON file that describes program, machine and settings, and a result file next to it.

Metrics are computed here; submitted ones are refused.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.exchange.judge import entry_record
from studies.exchange.league.frozen import SET, FrozenScene, frozen, mesh_key
from studies.exchange.meshes import given_mesh
from studies.metrics.metrics import METRICS
from studies.scene.scene import Scene
from studies.store.record import Record

LEAGUE = "league"
"""Attribute of its record: the entry as JSON."""
HANDED = {"metrics", "errors", *(metric.name for metric in METRICS)}
"""Names under which metrics would be handed in."""


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
    result: str
    """File name of the positions, next to the JSON file."""
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
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise StudyError(f"{path.name} cannot be read as an entry ({error})") from error
    if not isinstance(data, dict):
        raise StudyError(f"{path.name} holds no JSON object; docs/league.md lists what an entry needs")
    metrics = sorted(HANDED & set(data))
    if metrics:
        raise StudyError(f"{path.name} hands in {', '.join(metrics)}: metrics are computed here; leave them out")
    try:
        return EntryFile.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise StudyError(f"{path.name}: {where}: {first['msg'].lower()}; docs/league.md lists what it needs") from error


def check_entry(entry: EntryFile, scene: str) -> FrozenScene:
    """The scene of the set that the entry is of. Raises StudyError for an entry of another set or scene, one of a scene
    that is held back, and one on a mesh that is none of the set."""
    if entry.set != SET:
        raise StudyError(f"the entry is of set {entry.set}; this version judges {SET}: export the scene again")
    if entry.scene != scene:
        raise StudyError(f"the entry is of {entry.scene}, not of {scene}")
    if scene not in frozen():
        raise StudyError(f"{scene} is not in {SET}, which has {', '.join(frozen())}")
    frozen_scene = frozen()[scene]
    if frozen_scene.held_back:
        raise StudyError(f"{scene} of {SET} is held back: nobody can enter it before its data is published")
    key = mesh_key(entry.mesh, entry.nodes)
    if key in frozen_scene.meshes and frozen_scene.meshes[key] != entry.mesh_sha256:
        raise StudyError(
            f"mesh_sha256 of the entry is not that of {key} of {scene} in {SET}; compute on the exported mesh "
            "and copy its SHA-256 from scene.json"
        )
    if key not in frozen_scene.meshes:
        meshes = ", ".join(frozen_scene.meshes)
        raise StudyError(f"the mesh of the entry ({key}) is not one of {SET}, which has {meshes} of {scene}")
    return frozen_scene


def check_mesh_here(entry: EntryFile, scene: Scene) -> None:
    """Raises StudyError where this machine makes another mesh than that of the set, on which nothing can be judged."""
    if given_mesh(scene, entry.nodes, entry.mesh).digest != entry.mesh_sha256:
        raise StudyError(
            f"gmsh makes another mesh here than that of {SET} ({entry.scene}, {mesh_key(entry.mesh, entry.nodes)}); "
            "install the versions in constraints.txt"
        )


def judged_file(scene: Scene, entry: EntryFile, folder: Path) -> Record:
    """The record of an entry whose result lies in `folder`. Raises StudyError for anything that does not fit the
    scene."""
    if not entry.result or Path(entry.result).name != entry.result:
        raise StudyError(f"the result {entry.result!r} of the entry must lie next to its JSON file; give its file name")
    record = entry_record(scene, folder / entry.result, entry.engine, entry.nodes, seconds=entry.seconds)
    return replace(record, attributes=record.attributes | {LEAGUE: entry.model_dump_json()})


def write_entry_file(path: Path, entry: EntryFile) -> None:
    """Writes it. Raises StudyError where that fails."""
    write_whole(path, (entry.model_dump_json(indent=1) + "\n").encode())
