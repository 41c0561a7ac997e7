"""A study from start to end: what is stale runs, the rest stays; references and physics in parallel, timing alone."""

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from threading import Event, Thread
from typing import Protocol

from numba.core import event

from studies.base.atomic import write_whole
from studies.base.compile_watch import CompileWatch, watching
from studies.base.errors import StudyError
from studies.base.interrupts import die_quietly, died_of_it, held_back
from studies.catalog.study import Study
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import solve
from studies.runs.case import Case
from studies.runs.current import case_path
from studies.runs.run import run_case
from studies.store.archived import check_no_archive
from studies.sweep.own_files import Given, given_files, load_given
from studies.sweep.tasks import Task, tasks_of
from studies.timing.cases import time_cases, timing_is_current

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
    """Does a piece of work; where its record lies."""
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
) -> None:
    """Runs the tasks in `jobs` processes, which load the user's `files`. Ctrl-C keeps what is stored; a process that
    dies is reported by name."""
    if not tasks:
        return
    progress.begin("physics", len(tasks))
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))  # read by the libraries when a worker loads them
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=begin_worker, initargs=(writer, files))
    workers: list[BaseProcess] = []
    try:
        with held_back():
            futures: dict[Future[Path], Task] = {pool.submit(do, task): task for task in tasks}
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
    root: Path,
    studies: list[Study],
    jobs: int,
    progress: Progress,
    wanted: Callable[[Task], bool] | None = None,
    on_compile: Told = lambda name: None,
) -> int:
    """Brings the studies up to date below `root`; the number of pieces that had to run.

    `wanted` replaces the rule "what is not current". `on_compile` hears what is being compiled, from any thread.
    Raises StudyError when results cannot be written, and for a root that is an archive.
    """
    check_no_archive(root)
    rule = wanted or (lambda task: not task.is_current())
    todo = [task for task in tasks_of(root, studies) if rule(task)]
    if todo:
        check_writable(root)
        files = given_files(task.work for task in todo if isinstance(task.work, Case))
        with told_by_workers(on_compile) as writer:
            perform(todo, jobs, progress, writer=writer, files=files)
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
            with watching(on_compile):
                time_cases(root, study.name, pending, lambda name: progress.advance("timing", name))
    return len(todo) + measured


def check_writable(root: Path) -> None:
    """Raises StudyError before minutes are spent on results that could not be stored."""
    trial = root / ".trial"
    write_whole(trial, b"")
    trial.unlink(missing_ok=True)  # another run of this command may have been faster
