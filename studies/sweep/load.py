"""The stored runs of a study, with their references and frame times."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from studies.base.doing import doing
from studies.base.errors import OtherVersion, StudyError
from studies.catalog.study import Study
from studies.metrics.interval import second_mesh
from studies.metrics.metric import Metric
from studies.metrics.run import Run
from studies.metrics.table import Row, row_of
from studies.metrics.timing.cases import timing_of
from studies.metrics.timing.protocol import FrameTiming
from studies.reference.load import Reference, reference_for
from studies.scene.as_json import scene_to_json
from studies.scene.scene import Scene
from studies.store.archived import is_archive, shown_machine
from studies.store.entry import CODE_CHANGED, why_entry_is_stale
from studies.store.ledger import Ledger
from studies.store.record import Status, read_record
from studies.sweep.job import CaseJob, case_jobs, reference_jobs


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
        entries = map(self.ledger.entry, reference_jobs(self.ledger.root, [scene]))
        if scene_to_json(scene) not in self._read and all(entry and entry.status == Status.OK for entry in entries):
            return None
        reference = self._look(scene)
        return reference if isinstance(reference, StudyError) else None

    def warnings(self, scenes: Iterable[Scene]) -> list[StudyError]:
        """Those of the references that were read."""
        read = (self._read.get(scene_to_json(scene)) for scene in scenes)
        return [StudyError(one.warnings) for one in read if isinstance(one, Reference) and one.warnings]

    def _look(self, scene: Scene) -> Reference | StudyError | None:
        key = scene_to_json(scene)
        if key not in self._read:
            try:
                self._read[key] = reference_for(self.ledger.root, scene)
            except StudyError as error:
                self._read[key] = error
        return self._read[key]


def load_runs(root: Path, study: Study, references: References | None = None) -> tuple[list[Run], list[str]]:
    """The stored runs of a study with references and frame times, and what is missing or damaged,
    or a reference warns of, a sentence each.

    references: those of a ledger of `root`, where other studies need them too.
    """
    references = references or References(Ledger(root))
    runs, problems = list[Run](), reference_problems(references, study)
    for job in (jobs := case_jobs(root, study)):
        run, missing = load_run(references, job, jobs)
        runs += [run] if run else []
        problems += missing
    return runs, sentences([*problems, *references.warnings(study.scenes)])


def table_rows(references: References, study: Study, metrics: Sequence[Metric]) -> tuple[list[Row], list[str]]:
    """A row per stored case (studies.metrics.table), and what is missing or damaged, or a reference warns
    of, in sentences. One run is in memory at a time, and its second mesh."""
    rows, problems = list[Row](), reference_problems(references, study)
    for job in (jobs := case_jobs(references.ledger.root, study)):
        run, missing = load_run(references, job, jobs)
        rows += [row_of(run, metrics)] if run else []
        problems += missing
    return rows, sentences([*problems, *references.warnings(study.scenes)])


def load_run(references: References, job: CaseJob, jobs: Sequence[CaseJob] = ()) -> tuple[Run | None, list[StudyError]]:
    """The run of a case with its reference and frame times, None where it cannot be read; and what is wrong. jobs:
    those among which a run without a reference has its second mesh."""
    ledger = references.ledger
    doing(job.label)
    try:
        entry = ledger.entry(job)
        if entry is None:
            raise not_stored(ledger.root, job)
        if entry.fault:
            raise entry.error()
        run = Run(job.work, read_record(job.path), references.of(job.work.scene))
        if run.reference is None and (other := second_mesh(job.work, [one.work for one in jobs])) is not None:
            second = next(one for one in jobs if one.work == other)
            run = replace(run, second=load_run(references, second)[0])
    except StudyError as problem:
        return None, [problem]
    try:
        return replace(run, timing=frame_times(ledger, job)), []
    except StudyError as problem:
        return run, [problem]


def not_stored(root: Path, job: CaseJob) -> StudyError:
    return StudyError(f"case {job.label} {'is missing in the archive' if is_archive(root) else 'has not run'}")


def frame_times(ledger: Ledger, job: CaseJob) -> FrameTiming | None:
    """This machine's frame times of a case; None where it is not timed, or not by this code. An archive shows its own.

    Raises StudyError where they cannot be read.
    """
    entry = ledger.timing(job, shown_machine(ledger.root)) if job.work.timed else None
    if entry is not None and entry.fault:
        raise entry.error()
    why = why_entry_is_stale(entry, job.digest, job.fingerprint)
    if entry is None or (why is not None and not (why == CODE_CHANGED and is_archive(ledger.root))):
        return None
    return timing_of(read_record(job.path.with_name(entry.file)))


def reference_problems(references: References, study: Study) -> list[StudyError]:
    """Of the scenes of a study that lack their reference."""
    return [problem for scene in study.scenes if (problem := references.problem(scene)) is not None]


def sentences(problems: Sequence[StudyError]) -> list[str]:
    """One for each problem, but one for all files of another version: after an update these are all files."""
    others = [str(problem) for problem in problems if isinstance(problem, OtherVersion)]
    more = f" (and {len(others) - 1} more files)" if len(others) > 1 else ""
    messages = dict.fromkeys(str(problem) for problem in problems if not isinstance(problem, OtherVersion))
    return [*messages, others[0] + more] if others else [*messages]
