"""A study from start to end: what is stale runs, the rest stays; references and physics in parallel, timing alone."""

import multiprocessing
import os
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Event, Thread
from typing import Protocol

from numba.core import event

from studies.base.atomic import write_whole
from studies.base.compile_watch import CompileWatch, watching
from studies.base.interrupts import die_quietly
from studies.catalog.study import Study
from studies.geometry.mesher.jobs import cache_folder
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import solve
from studies.runs.case import Case
from studies.runs.current import case_path
from studies.runs.run import run_case
from studies.store.archived import check_no_archive
from studies.sweep.failures import Failures, store_failure
from studies.sweep.known import Known
from studies.sweep.own_files import Given, given_files, load_given
from studies.sweep.tasks import Task, tasks_of
from studies.sweep.workers import done_or_dead
from studies.timing.alone import alone
from studies.timing.cases import time_cases

COMPILED = "NUMBA_CACHE_DIR"
"""Where the user may want compiled code."""
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


def do(task: Task) -> Path:
    """Does a piece of work, unless another command has meanwhile; where its record lies."""
    if task.done_meanwhile():
        return task.path()
    if isinstance(task.work, ReferenceSolve):
        return solve(task.root, task.work)
    return run_case(task.root, task.study, task.work)


POLL_SECONDS = 0.2
Told = Callable[[str], object]
"""Called with the name of a function that is being compiled."""


@contextmanager
def told_by_workers(on_compile: Told) -> Iterator[Connection]:
    """Where processes send the names of what they compile; `on_compile` gets them, in a thread.

    A pipe and no queue: short messages need no lock, which a process that is killed could hold for ever."""
    reader, writer = multiprocessing.get_context("spawn").Pipe(duplex=False)
    ended = Event()

    def forward() -> None:
        while not ended.is_set():
            if reader.poll(POLL_SECONDS):
                on_compile(reader.recv())

    thread = Thread(target=forward, daemon=True)
    thread.start()
    try:
        yield writer
    finally:
        ended.set()
        thread.join()


def begin_worker(writer: Connection | None, files: tuple[Given, ...] = ()) -> None:
    """What every process does first: it ends quietly, loads the user's `files`, and tells what it compiles."""
    die_quietly()
    load_given(files)
    if writer is not None:
        event.register("numba:compile", CompileWatch(writer.send))


def perform(
    tasks: list[Task],
    jobs: int,
    progress: Progress,
    do: Callable[[Task], Path] = do,
    writer: Connection | None = None,
    files: tuple[Given, ...] = (),
    on_death: Callable[[Task, str], object] = store_failure,
) -> None:
    """Runs the tasks in `jobs` processes, which load the user's `files`. Ctrl-C keeps what is stored. A task whose
    process dies is tried twice again, then given to `on_death` with the cause, and the rest goes on."""
    if not tasks:
        return
    progress.begin("physics", len(tasks))
    begin = partial(begin_worker, writer, files)
    with environment_of_workers(), closing(done_or_dead(tasks, jobs, do, begin)) as ended:
        for task, cause in ended:
            if cause is not None:
                on_death(task, cause)
            progress.advance("physics", task.label)


@contextmanager
def environment_of_workers() -> Iterator[None]:
    """Inside, processes that start get one thread, and the caches of this process wherever they work."""
    wanted = {**dict.fromkeys(ONE_THREAD, "1"), "ORGANBENCH_CACHE": str(cache_folder().absolute())}
    if os.environ.get(COMPILED):
        wanted[COMPILED] = str(Path(os.environ[COMPILED]).absolute())
    before = {name: os.environ.get(name) for name in wanted}
    os.environ.update(wanted)  # read by the libraries when a worker loads them
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def run_studies(
    root: Path,
    studies: list[Study],
    jobs: int,
    progress: Progress,
    wanted: Callable[[Task], bool] | None = None,
    on_compile: Told = lambda name: None,
    failures: Failures | None = None,
) -> int:
    """Brings the studies up to date below `root`; the number of pieces that had to run.

    `wanted` replaces the rule "what is not current". `on_compile` hears what is being compiled, from any thread.
    `failures` hears of pieces whose process died; they are stored as failed. Another command may work on the same
    folder. Raises StudyError when results cannot be written, and for a root that is an archive.
    """
    check_no_archive(root)
    root = root.absolute()
    known = Known(root)
    rule = wanted or (lambda task: known.why_stale(task) is not None)
    todo = [replace(task, seen=task.state()) for task in tasks_of(root, studies) if rule(task)]
    if todo:
        check_writable(root)
        files = given_files(task.work for task in todo if isinstance(task.work, Case))
        with told_by_workers(on_compile) as writer:
            on_death = (failures or Failures()).add
            perform(todo, jobs, progress, writer=writer, files=files, on_death=on_death)
    ran = {task.path() for task in todo}
    measured = sum(
        measure_times(root, study, progress, on_compile, None if wanted is None else ran) for study in studies
    )
    return len(todo) + measured


def measure_times(root: Path, study: Study, progress: Progress, on_compile: Told, among: set[Path] | None) -> int:
    """Times what is not timed yet, of `among` where given, when no other command does; how many that were."""

    def pending() -> list[Case]:
        known = Known(root)
        return [
            case
            for case in study.cases
            if case.timed and known.can_be_timed(study.name, case) and known.why_untimed(study.name, case) is not None
            if among is None or case_path(root, study.name, case) in among
        ]

    if not pending():
        return 0
    with alone(root), watching(on_compile):
        left = pending()  # another command may have done it meanwhile
        if left:
            progress.begin("timing", len(left))
            time_cases(root, study.name, left, lambda name: progress.advance("timing", name))
    return len(left)


def check_writable(root: Path) -> None:
    """Raises StudyError before minutes are spent on results that could not be stored."""
    trial = root / ".trial"
    write_whole(trial, b"")
    trial.unlink(missing_ok=True)  # another run of this command may have been faster
