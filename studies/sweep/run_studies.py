"""A study from start to end: what is stale runs, the rest stays; references and physics in parallel, timing alone."""

import multiprocessing
import os
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Protocol, TypeVar

from studies.base.atomic import is_there, write_whole
from studies.base.errors import OtherVersion, StudyError
from studies.base.interrupts import die_quietly, died_of_it, held_back
from studies.catalog import Study
from studies.metrics.metrics import Run
from studies.reference.load import load_reference
from studies.reference.solve import Piece, pieces, solve
from studies.runs.case import Case
from studies.runs.run import case_path, run_case, why_case_is_stale
from studies.store.record import Record, Status, peek, read_record
from studies.store.staleness import MISSING
from studies.timing.cases import read_timing, time_cases, timing_is_current

T = TypeVar("T")
ONE_THREAD = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Every process computes on one core: the cores are shared out by cases, not inside them."""


class Progress(Protocol):
    """Who wants to know how far a sweep is."""

    def begin(self, what: str, total: int) -> None:
        """A stage of `total` pieces begins."""
        ...

    def advance(self, what: str, note: str) -> None:
        """One piece is done."""
        ...


@dataclass(frozen=True)
class Task:
    """One piece of work that can run in any process: a piece of a reference, or a case."""

    root: Path
    study: str
    work: Case | Piece

    @property
    def weight(self) -> float:
        """Longest first keeps both cores busy to the end: references by mesh, then cases by size over step."""
        if isinstance(self.work, Piece):
            return 1e9 + self.work.weight
        return self.work.body.nodes / self.work.dt_fraction

    @property
    def label(self) -> str:
        """For progress and messages."""
        return f"reference {self.work.name}" if isinstance(self.work, Piece) else self.work.name

    def is_current(self) -> bool:
        """Whether it need not run."""
        return self.why_stale() is None

    def why_stale(self) -> str | None:
        """Why it must run (again) (studies.store.staleness); None when it need not."""
        if isinstance(self.work, Piece):
            return self.work.why_stale(self.root)
        return why_case_is_stale(self.root, self.study, self.work)

    def path(self) -> Path:
        """Where its record lies."""
        return (
            self.work.path(self.root) if isinstance(self.work, Piece) else case_path(self.root, self.study, self.work)
        )

    def perform(self) -> Path:
        """Does it."""
        if isinstance(self.work, Piece):
            return solve(self.root, self.work)
        return run_case(self.root, self.study, self.work)


def tasks_of(root: Path, studies: Iterable[Study]) -> list[Task]:
    """Everything the studies need, each piece once, longest first."""
    tasks: dict[Path, Task] = {}
    for study in studies:
        found = [piece for scene in study.scenes for piece in pieces(scene)]
        for work in (*found, *study.cases):
            task = Task(root, study.name, work)
            tasks[task.path()] = task
    return sorted(tasks.values(), key=lambda task: -task.weight)


def perform(tasks: list[Task], jobs: int, progress: Progress) -> None:
    """Runs the tasks in `jobs` processes. Ctrl-C keeps what is stored; a process that dies is reported by name."""
    if not tasks:
        return
    progress.begin("physics", len(tasks))
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))  # read by the libraries when a worker loads them
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=die_quietly)
    workers: list[BaseProcess] = []
    try:
        with held_back():
            futures: dict[Future[Path], Task] = {pool.submit(task.perform): task for task in tasks}
            workers = multiprocessing.active_children()
        for future in as_completed(futures):
            future.result()
            progress.advance("physics", futures[future].label)
    except BrokenProcessPool as error:
        pool.shutdown()  # waits until every exit code is known
        if any(died_of_it(worker.exitcode) for worker in workers):
            raise KeyboardInterrupt from error  # the interrupt of this process is still being handled
        raise StudyError(
            "a computing process died (out of memory, or killed); what is finished is stored, run the command again"
        ) from error
    except KeyboardInterrupt:
        for worker in workers:  # a signal to this process alone did not reach them
            worker.terminate()
        raise
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def run_studies(
    root: Path, studies: list[Study], jobs: int, progress: Progress, wanted: Callable[[Task], bool] | None = None
) -> int:
    """Brings the studies up to date below `root`; the number of pieces that had to run.

    `wanted` replaces the rule "what is not current". Raises StudyError when results cannot be written.
    """
    rule = wanted or (lambda task: not task.is_current())
    todo = [task for task in tasks_of(root, studies) if rule(task)]
    if todo:
        check_writable(root)
    perform(todo, jobs, progress)
    measured, ran = 0, {task.path() for task in todo}
    for study in studies:
        pending = [
            case
            for case in study.cases
            if case.timed and not timing_is_current(root, study.name, case)
            if wanted is None or case_path(root, study.name, case) in ran
        ]
        measured += len(pending)
        if pending:
            progress.begin("timing", len(pending))
            time_cases(root, study.name, pending, lambda name: progress.advance("timing", name))
    return len(todo) + measured


def check_writable(root: Path) -> None:
    """Raises StudyError before minutes are spent on results that could not be stored."""
    trial = root / ".trial"
    write_whole(trial, b"")
    trial.unlink(missing_ok=True)  # another run of this command may have been faster


def load_runs(root: Path, study: Study) -> tuple[list[Run], list[str]]:
    """The stored runs of a study with references and timings, and what is missing or damaged, a sentence each."""
    problems: list[StudyError] = []

    def tried(load: Callable[[], T]) -> T | None:
        try:
            return load()
        except StudyError as error:
            problems.append(error)
            return None

    references = {scene.name: tried(partial(load_reference, root, scene)) for scene in study.scenes}
    runs = []
    for case in study.cases:
        path = case_path(root, study.name, case)
        if not is_there(path):
            problems.append(StudyError(f"case {case.name} has not run"))
            continue
        record = tried(partial(read_record, path))
        if record is not None:
            timing = tried(partial(read_timing, root, study.name, case)) if case.timed else None
            runs.append(Run(case, record, references[case.scene.name], timing))
    return runs, _remarks(problems)


def _remarks(problems: list[StudyError]) -> list[str]:
    """A sentence each, but one for all files of another version: after an update these are all files."""
    others = [str(problem) for problem in problems if isinstance(problem, OtherVersion)]
    more = f" (and {len(others) - 1} more files)" if len(others) > 1 else ""
    said = [str(problem) for problem in problems if not isinstance(problem, OtherVersion)]
    return [*said, others[0] + more] if others else said


def warnings_of(root: Path, study: Study) -> list[str]:
    """What the cases of a study warned of when they were prepared, a sentence each."""
    records = [stored(case_path(root, study.name, case)) for case in study.cases]
    said = [record.attributes.get("warnings", "") for record in records if record is not None]
    return [str(sentence) for sentence in said if sentence]


def stored(path: Path) -> Record | None:
    """The header of a stored result; None where there is none, or none that can be read."""
    try:
        return peek(path)
    except StudyError:
        return None


@dataclass(frozen=True)
class Standing:
    """How a piece of work stands."""

    task: Task
    status: str
    """A Status, "stale" or "missing"."""
    message: str


def standings(root: Path, study: Study) -> list[Standing]:
    """Every piece of a study: ok, failed in some way, stale or missing."""
    found = []
    for task in tasks_of(root, [study]):
        why = task.why_stale()
        if why is None:
            record = peek(task.path())
            found.append(Standing(task, str(record.status), record.message))
        else:
            found.append(Standing(task, "missing" if why == MISSING else "stale", why))
    return found


def failed(task: Task) -> bool:
    """Whether the stored result of a task is no success; a damaged file is stale instead."""
    record = stored(task.path())
    return record is not None and record.status in (Status.FAILED, Status.NOT_CONVERGED, Status.TIMED_OUT)
