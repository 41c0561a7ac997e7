"""The stored runs of a study, with their references and frame times."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from studies.base.errors import OtherVersion, StudyError
from studies.catalog.study import Study
from studies.metrics.run import Run
from studies.reference.load import Reference, load_reference
from studies.reference.reference_solves import STUDY as REFERENCES
from studies.reference.reference_solves import reference_solves
from studies.runs.case import Case
from studies.scene.as_json import scene_to_json
from studies.scene.scene import Scene
from studies.store.archived import is_archive
from studies.store.ledger import Ledger
from studies.store.record import Status, read_record
from studies.sweep.tasks import case_tasks
from studies.timing.cases import read_timing


class References:
    """The references of scenes, each read when it is first asked for, and once however many studies need it."""

    def __init__(self, ledger: Ledger) -> None:
        self.ledger = ledger
        self._read: dict[str, Reference | StudyError | None] = {}
        """By the scene as JSON: a user's study may have another scene of the same name."""

    def of(self, scene: Scene) -> Reference | None:
        """None where there is none; see `problem`."""
        reference = self._look(scene)
        return None if isinstance(reference, StudyError) else reference

    def problem(self, scene: Scene) -> StudyError | None:
        """Why a scene with a plan has none. Solutions that are there and went well are not read for that."""
        files = self.ledger.files(REFERENCES)
        entries = [files.get(solve.path(self.ledger.root).name) for solve in reference_solves(scene)]
        if scene_to_json(scene) not in self._read and all(entry and entry.status == Status.OK for entry in entries):
            return None
        reference = self._look(scene)
        return reference if isinstance(reference, StudyError) else None

    def _look(self, scene: Scene) -> Reference | StudyError | None:
        key = scene_to_json(scene)
        if key not in self._read:
            try:
                self._read[key] = load_reference(self.ledger.root, scene)
            except StudyError as error:
                self._read[key] = error
        return self._read[key]


def load_runs(root: Path, study: Study, references: References | None = None) -> tuple[list[Run], list[str]]:
    """The stored runs of a study with references and frame times, and what is missing or damaged, a sentence each.

    references: those of a ledger of `root`, where other studies need them too.
    """
    references = references or References(Ledger(root))
    reference_of = {scene.name: references.of(scene) for scene in study.scenes}
    runs, problems = [], reference_problems(references, study)
    for task in case_tasks(root, study):
        entry = references.ledger.entry(task)
        try:
            if entry is None:
                raise not_stored(root, task.work)
            if entry.fault:
                raise entry.error()
            record, timing = read_record(task.path()), None
        except StudyError as error:
            problems.append(error)
            continue
        try:
            timing = read_timing(root, study.name, task.work) if task.work.timed else None
        except StudyError as error:
            problems.append(error)
        runs.append(Run(task.work, record, reference_of[task.work.scene.name], timing))
    return runs, sentences(problems)


def reference_problems(references: References, study: Study) -> list[StudyError]:
    """Of the scenes of a study that lack their reference."""
    return [problem for scene in study.scenes if (problem := references.problem(scene)) is not None]


def not_stored(root: Path, case: Case) -> StudyError:
    """The error of a case without a file."""
    what = "is missing in the archive" if is_archive(root) else "has not run"
    return StudyError(f"case {case.name} {what}")


def sentences(problems: Sequence[StudyError]) -> list[str]:
    """One for each problem, but one for all files of another version: after an update these are all files."""
    others = [str(problem) for problem in problems if isinstance(problem, OtherVersion)]
    more = f" (and {len(others) - 1} more files)" if len(others) > 1 else ""
    messages = [str(problem) for problem in problems if not isinstance(problem, OtherVersion)]
    return [*messages, others[0] + more] if others else messages


def stored_state(ledger: Ledger, scenes: Iterable[Scene]) -> str:
    """The files of the references of scenes with their sizes and times, as text."""
    files = ledger.files(REFERENCES)
    names = [solve.path(ledger.root).name for scene in scenes for solve in reference_solves(scene)]
    return " ".join(files[name].written if name in files else f"{name} -" for name in names)
