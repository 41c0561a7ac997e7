"""What can be viewed, a line each."""

import json
from pathlib import Path

from studies.base.counting import counted
from studies.base.errors import StudyError
from studies.report.view.stored import Stored, finest_reference, stored_runs
from studies.scene.as_json import scene_of_key
from studies.scene.library import SCENES
from studies.store.record import Status
from studies.sweep.load import sentences


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
