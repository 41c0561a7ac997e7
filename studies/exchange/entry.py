"""External entries as records in the same form as our runs: storage under the name of the entry, and loading."""

import json
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import ClassVar

import numpy as np

from massspring import LITERATURE, METHODS, Method
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities
from studies.base.errors import StudyError
from studies.exchange.meshes import given_scene, reference_of
from studies.metrics.run import Run
from studies.metrics.timing.protocol import FrameTiming
from studies.reference.load import Reference
from studies.runs.case import Case
from studies.runs.recipes import BODIES
from studies.scene.as_json import scene_of_key, scene_to_json
from studies.scene.scene import Scene
from studies.store.paths import readable, record_files, record_path
from studies.store.record import Record, read_record

FOLDER = "entries"
"""Folder of entries in the results."""
ENTRY, SECONDS = "entry", "entry_seconds"
"""Attributes of its record."""


@dataclass(frozen=True)
class Outside(Method):
    """The method of an external entry, which cannot be run here. Each entry has a separate class, for its name."""

    name: ClassVar[str] = "outside"
    order: ClassVar[int] = 0
    volume_tol: ClassVar[float | None] = None
    capabilities: ClassVar[Capabilities] = Capabilities("none")

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        """Raises StudyError."""
        raise StudyError(f"'{self.name}' is a result of another program: only that program can run it")


@cache
def outside(name: str) -> Outside:
    """The method that stands for an entry. Raises StudyError for a name that is a method's, or that is no name."""
    if name in [method.name for method in (*METHODS, *LITERATURE)]:
        raise StudyError(
            f"'{name}' is a method of this program; give your entry another name (--name, or engine in a JSON file)"
        )
    if not name or readable(name) != name:
        raise StudyError(
            f"{name!r} cannot name an entry; use letters, digits, '.', '_' and '-' (--name, or engine in a JSON file)"
        )
    return dataclass(frozen=True)(type(name, (Outside,), {"name": name, "__module__": __name__}))()


def is_entry(case: Case) -> bool:
    """Whether a case is an entry from outside."""
    return isinstance(case.method, Outside)


def entry_path(root: Path, case: Case) -> Path:
    """Where the record of an entry lies."""
    return record_path(root, FOLDER, entry_name(case), case.key)


def entry_name(case: Case) -> str:
    """SCENE-MESH-NODES-NAME."""
    return f"{case.scene.name}-{sides_of(case)}-{case.body.nodes}-{case.method.name}"


def sides_of(case: Case) -> str:
    """Of the elements of the mesh on which an entry was handed in."""
    return "curved" if case.body.kind == "quadratic" else "straight"


def run_of_entry(record: Record, reference: Reference | None) -> Run:
    """The run of an entry; reference: that of its scene, which for a cut scene may include checkpoints before the
    cut. Raises StudyError for a record that is no entry."""
    attributes = record.attributes
    if attributes.get(ENTRY) is None:
        raise StudyError(f"'{record.name}' is not a result of another program")
    data, seconds = json.loads(record.key), attributes.get(SECONDS)
    try:
        recipe = BODIES[data["body"]["kind"]](int(data["body"]["nodes"]))
        case = Case(scene_of_key(record.key), recipe, outside(data["method"]["name"]))
    except (LookupError, TypeError, ValueError) as error:
        raise StudyError(f"'{record.name}' is not a result of another program ({error})") from error
    timing = None
    if seconds is not None:
        timing = FrameTiming(np.full((1, int(attributes["frames"])), 1e9 * seconds * attributes["frame"]))
    return Run(case, record, reference_of(case.scene, reference), timing)


def entry_files(root: Path) -> list[Path]:
    """The records of all entries, sorted."""
    return record_files(root, FOLDER)


def entries_beside(
    root: Path, scenes: Iterable[Scene], reference_for: Callable[[Scene], Reference | None]
) -> tuple[list[Run], list[str]]:
    """The entries in `scenes`, judged by the references of these; and what cannot be read, a sentence each. Scenes that
    differ only in the meshes of the reference or the number of frames count as the same."""
    pairs, runs, problems = dict[str, tuple[Scene, Scene]](), [], []
    for scene in scenes:
        with suppress(StudyError):  # one that is not given away has no entry
            given = given_scene(scene)
            pairs[_same(given)] = given, scene
    for path in entry_files(root):
        try:
            run = run_of_entry(read_record(path), None)
        except StudyError as problem:
            problems.append(str(problem))
            continue
        if (pair := pairs.get(_same(run.case.scene))) is not None:
            given, scene = pair
            case = run.case.replaced(scene=given)
            runs.append(replace(run, case=case, reference=reference_of(given, reference_for(scene))))
    return runs, problems


def _same(scene: Scene) -> str:
    return scene_to_json(replace(scene, reference=None, frames=1))
