"""The runs of a calibration: made once, stored with the others, read back where they are current."""

from collections.abc import Iterable
from pathlib import Path

from studies.base.errors import StudyError
from studies.metrics.judged import Judged, judged
from studies.metrics.run import Run
from studies.reference.load import Reference, reference_for
from studies.runs.case import BodyRecipe, Case
from studies.scene.scene import Scene
from studies.store.ledger import Ledger
from studies.store.record import read_record
from studies.sweep.executor import CompileListener, Progress, perform
from studies.sweep.job import CaseJob, Job, reference_jobs
from studies.sweep.local import Local
from studies.sweep.run_studies import check_writable
from studies.tools.calibrate.stored import STUDY


def pending(ledger: Ledger, scenes: Iterable[Scene], start: BodyRecipe) -> list[Job]:
    """Pieces of references and runs of the starting body that are missing or stale, the longest first."""
    root, scenes = ledger.root, list(scenes)
    jobs = [*reference_jobs(root, scenes), *(CaseJob(root, STUDY, Case(scene, start)) for scene in scenes)]
    return sorted((job for job in jobs if ledger.why(job) is not None), key=lambda job: -job.weight)


def bring_up_to_date(todo: list[Job], root: Path, jobs: int, progress: Progress, on_compile: CompileListener) -> None:
    """Does them in `jobs` processes. Raises StudyError when results cannot be written."""
    check_writable(root)
    perform(Local(jobs), todo, progress, on_compile, Job.store_failure)


class Measurements:
    """Errors of recipes in scenes, from stored runs where there are any."""

    def __init__(self, ledger: Ledger, scenes: Iterable[Scene]) -> None:
        self.root = root = ledger.root
        self.ledger = ledger
        self.references: dict[str, Reference | None] = {scene.name: reference_for(root, scene) for scene in scenes}
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
                f"{run.case.name} ended as {run.record.status} before the fit ({run.record.message}); "
                "give another number of nodes"
            )
        return errors

    def _run(self, scene: Scene, recipe: BodyRecipe) -> Run:
        job = CaseJob(self.root, STUDY, Case(scene, recipe))
        if self.ledger.why(job) is not None:
            job.run()
            self.ledger.look_again()
            self.made += 1
        return Run(job.work, read_record(job.path()), self.references[scene.name])
