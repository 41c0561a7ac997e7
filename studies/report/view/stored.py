"""What is stored and can be viewed: runs, and the reference of their scene; as a list too."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from studies.base.counting import counted
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.reference.reference_solves import STUDY as REFERENCES
from studies.reference.reference_solves import ReferenceSolve
from studies.scene.as_json import scene_of_key
from studies.scene.library import SCENES
from studies.scene.scene import Scene
from studies.store.paths import record_files
from studies.store.record import Record, Status, peek
from studies.store.schema import WITHOUT_FIELDS
from studies.sweep.load import sentences


@dataclass(frozen=True, eq=False)
class Stored:
    """The file of a run with something to see in it."""

    path: Path
    header: Record
    """Without fields."""

    @cached_property
    def scene_data(self) -> dict[str, Any]:
        return json.loads(self.header.key)["scene"]

    @property
    def scene(self) -> str:
        return str(self.scene_data["name"])

    @property
    def physics(self) -> str:
        """Its case without additional recorded fields: the same for runs with the same numbers."""
        data = json.loads(self.header.key)
        data.pop("recorded", None)
        return json.dumps(data, sort_keys=True)

    @property
    def words(self) -> tuple[str, str]:
        """Its names: that of its case, which several runs may share, and the unique one of its file."""
        return self.header.name, self.path.stem


def stored_runs(root: Path) -> tuple[list[Stored], list[StudyError]]:
    """All runs in the folders of `root` that can be viewed, the same one of several studies once; and what is wrong
    with each file that cannot be read. Raises StudyError where there is no such folder."""
    if not root.is_dir():
        raise StudyError(f"there is no folder {root}; --results names the folder of the results")
    studies = [folder.name for folder in sorted(root.iterdir()) if folder.is_dir() and folder.name != REFERENCES]
    runs, problems = dict[tuple[str, str], Stored](), list[StudyError]()
    for path in (path for study in studies for path in record_files(root, study)):
        try:
            entry = stored_run(path)
        except StudyError as problem:
            problems.append(problem)
            continue
        if entry is not None:
            runs.setdefault((entry.physics, entry.header.fingerprint), entry)
    return sorted(runs.values(), key=lambda run: run.path.stem), problems


def stored_run(path: Path) -> Stored | None:
    """The run in a file; None of another kind of record, or one that never started. Raises StudyError as `peek`."""
    header = peek(path)
    if header.kind != "run" or header.status in WITHOUT_FIELDS:
        return None
    return Stored(path, header)


def finest_reference(root: Path, scene: Scene) -> Path | None:
    """The file of a scene's reference; None where it is not stored, or did not converge."""
    if scene.reference is None:
        return None
    path = ReferenceSolve(scene).path(root)
    return path if path.is_file() and peek(path).status == Status.OK else None


def chosen_runs(words: Sequence[str], runs: Sequence[Stored], scenes: Iterable[str]) -> list[Stored]:
    """The runs that words name: one of `scenes` by name (all of its runs), a case, or a results file.

    Raises StudyError for a word that names nothing, and for a file without a run to see.
    """
    by_word: dict[str, list[Stored]] = {scene: [] for scene in scenes}
    for run in runs:
        for word in dict.fromkeys((run.scene, *run.words)):
            by_word.setdefault(word, []).append(run)
    matches = [run for word in words for run in (_in_file(word) or lookup(word, by_word, "scene or stored case"))]
    return list({run.path.resolve(): run for run in matches}.values())


def _in_file(word: str) -> list[Stored]:
    if not word.endswith(".h5"):
        return []
    run = stored_run(Path(word))
    if run is None:
        raise StudyError(f"{word} has no run to view; `organbench show` lists its content")
    return [run]


def listing(root: Path) -> tuple[list[str], list[str]]:
    """Lines: each scene with its reference, and below it its cases by their file's name; and a sentence for each file
    that cannot be read. Raises StudyError where there is no such folder, and where nothing is stored in it."""
    runs, problems = stored_runs(root)
    by_scene: dict[str, list[Stored]] = {scene.name: [] for scene in SCENES}
    for run in runs:
        by_scene.setdefault(run.scene, []).append(run)
    lines = []
    for name, cases in by_scene.items():
        reference, more = _reference(root, name, cases)
        problems += more
        if cases or reference:
            lines.append(f"{name}: {counted(len(cases), 'case')}, {reference or 'no reference'}")
            lines += [f"  {_line(case)}" for case in cases]
    if not lines:
        raise StudyError(f"nothing to view is stored in {root}; run `organbench run` first")
    return lines, sentences(problems)


def _reference(root: Path, name: str, cases: list[Stored]) -> tuple[str, list[StudyError]]:
    """The stored reference of a scene, as its cases or this version know it; and what cannot be read."""
    different = {json.dumps(case.scene_data): case for case in cases}.values()
    try:
        scenes = [scene_of_key(case.header.key) for case in different]
        for scene in scenes or [scene for scene in SCENES if scene.name == name]:
            path = finest_reference(root, scene)
            if path is not None:
                return f"reference {path.stem}", []
    except StudyError as problem:
        return "", [problem]
    return "", []


def _line(case: Stored) -> str:
    return case.path.stem if case.header.status == Status.OK else f"{case.path.stem} ({case.header.status})"
