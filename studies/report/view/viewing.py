"""From words to bodies: the cases that they name, with the reference of their scene."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from studies.base.errors import StudyError
from studies.metrics.run import Run
from studies.reference.solution import Solution
from studies.report.view.bodies import Shown, shown_reference, shown_run
from studies.report.view.stored import Stored, chosen_runs, finest_reference, stored_runs
from studies.runs.case import Case
from studies.scene.as_json import scene_of_key
from studies.scene.library import SCENES
from studies.scene.scene import Scene
from studies.store.record import Status, read_record
from studies.sweep.load import sentences


@dataclass(eq=False)
class View:
    """Bodies of one scene: first the reference, then the cases as they were named."""

    scene: Scene
    bodies: list[Shown]
    remarks: list[str]
    """What is missing, a sentence each."""

    @property
    def times(self) -> np.ndarray:
        """The checkpoints of the scene [s], (K,)."""
        return np.array(self.scene.checkpoints)


@dataclass
class _References:
    """References by the file they lie in, each read once; those of scenes that differ only in frames are one."""

    read: dict[Path, Solution] = field(default_factory=dict)
    remarks: dict[str, None] = field(default_factory=dict)
    """Sentences in order, each once."""

    def of(self, root: Path, scene: Scene) -> Solution | None:
        if scene.reference is None:
            return None
        try:
            path = finest_reference(root, scene)
            if path is not None and path not in self.read:
                self.read[path] = Solution(scene, read_record(path))
        except StudyError as problem:
            self.remarks[str(problem)] = None
            return None
        if path is None:
            self.remarks[f"the reference of '{scene.name}' is not stored in {root}, so no errors are shown"] = None
            return None
        return self.read[path]


def view(root: Path, words: Sequence[str], own: Sequence[Scene] = ()) -> View:
    """The runs below `root` that words name (a scene, a case, a results file), with the reference of their scene.

    own: scenes of the user, in addition to SCENES.

    Raises StudyError for a word that names nothing stored, for cases of several scenes or with other checkpoints, and
    where nothing can be read.
    """
    files = all(word.endswith(".h5") for word in words)
    runs, problems = ([], []) if files else stored_runs(root)
    references = _References()
    scenes = {scene.name: scene for scene in (*SCENES, *own)}
    loaded = []
    for stored in chosen_runs(words, runs, scenes):
        try:
            loaded.append((stored, _run(stored)))
        except StudyError as problem:
            problems.append(problem)
    remarks = sentences(problems)
    scene = _one_scene(root, [scenes[word] for word in words if word in scenes], [run for _, run in loaded], remarks)
    cases = [_shown(stored, run, references) for stored, run in loaded]
    if not loaded:
        references.of(root, scene)
    shown = [shown_reference(solution, f"reference {path.stem}") for path, solution in references.read.items()]
    if not shown and not cases:
        raise StudyError(f"nothing of '{scene.name}' is stored in {root}; run `organbench run` first")
    return View(scene, [*shown, *cases], [*remarks, *references.remarks])


def _run(stored: Stored) -> Run:
    record = read_record(stored.path)
    return Run(Case(scene_of_key(record.key)), record)  # of the case only its scene is shown


def _shown(stored: Stored, run: Run, references: _References) -> Shown:
    status = run.record.status
    name = stored.path.stem if status == Status.OK else f"{stored.path.stem} ({status})"
    # A file outside the results folder uses the references of its folder.
    return shown_run(run, references.of(stored.path.parent.parent, run.case.scene), name)


def _one_scene(root: Path, named: Sequence[Scene], runs: Sequence[Run], remarks: Sequence[str]) -> Scene:
    """The scene of all runs; without runs the one that was named. Raises StudyError where there are several."""
    scenes = [run.case.scene for run in runs] or list(named)
    if not scenes:
        raise StudyError(remarks[0] if remarks else f"there are no results in {root}; run `organbench run` first")
    for other in scenes[1:]:
        if other.name != scenes[0].name:
            raise StudyError(f"'{scenes[0].name}' and '{other.name}' are two scenes; view each in a file of its own")
        if other.checkpoints != scenes[0].checkpoints:
            raise StudyError(
                f"the chosen cases of '{other.name}' have different checkpoints, because the scene has changed; "
                "name cases with the same ones"
            )
    return scenes[0]
