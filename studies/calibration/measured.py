"""The runs that a calibration rests on: made once, stored with the others, read back where they are current."""

from collections.abc import Iterable
from pathlib import Path

from studies.base.errors import StudyError
from studies.calibration.stored import STUDY
from studies.metrics.judged import Judged, judged
from studies.metrics.run import Run
from studies.reference.load import Reference, load_reference
from studies.reference.reference_solves import reference_solves
from studies.runs.case import BodyRecipe, Case
from studies.runs.current import case_path, why_case_is_stale
from studies.runs.run import run_case
from studies.scene.scene import Scene
from studies.store.record import read_record
from studies.sweep.executor import Progress, Told, perform
from studies.sweep.failures import store_failure
from studies.sweep.local import Local
from studies.sweep.run_studies import check_writable
from studies.sweep.tasks import Task


def pending(root: Path, scenes: Iterable[Scene], start: BodyRecipe) -> list[Task]:
    """Pieces of references and runs of the starting body that are missing or stale, the longest first."""
    works = [work for scene in scenes for work in (*reference_solves(scene), Case(scene, start))]
    tasks = [Task(root, STUDY, work) for work in works]
    return sorted((task for task in tasks if not task.is_current()), key=lambda task: -task.weight)


def bring_up_to_date(tasks: list[Task], root: Path, jobs: int, progress: Progress, on_compile: Told) -> None:
    """Does them in `jobs` processes. Raises StudyError when results cannot be written."""
    check_writable(root)
    perform(Local(jobs), tasks, progress, on_compile, store_failure)


class Measurements:
    """Errors of recipes in scenes, from stored runs where there are any."""

    def __init__(self, root: Path, scenes: Iterable[Scene]) -> None:
        self.root = root
        self.references: dict[str, Reference | None] = {scene.name: load_reference(root, scene) for scene in scenes}
        self.made = 0
        """Runs that were not there."""

    def errors(self, scene: Scene, recipe: BodyRecipe) -> Judged | None:
        """Of one recipe in one scene; None where its run ended badly."""
        return judged(self._run(scene, recipe))

    def first_errors(self, scene: Scene, recipe: BodyRecipe) -> Judged:
        """The same. Raises StudyError, with the reason, where the run ended badly."""
        run = self._run(scene, recipe)
        errors = judged(run)
        if errors is None:
            raise StudyError(
                f"{run.case.name} is {run.record.status} before anything is fitted ({run.record.message}); "
                "give another number of nodes"
            )
        return errors

    def _run(self, scene: Scene, recipe: BodyRecipe) -> Run:
        case = Case(scene, recipe)
        if why_case_is_stale(self.root, STUDY, case) is not None:
            run_case(self.root, STUDY, case)
            self.made += 1
        return Run(case, read_record(case_path(self.root, STUDY, case)), self.references[scene.name])
