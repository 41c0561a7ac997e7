"""Pieces of a sweep in processes of this machine."""

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Event, Thread

from numba.core import event

from studies.base.compile_watch import CompileWatch
from studies.base.interrupts import die_quietly
from studies.base.portable import environment as portable_environment
from studies.catalog.study import Study
from studies.geometry.mesher.jobs import cache_folder
from studies.sweep.engine import Progress, Told
from studies.sweep.frame_times import measure_times
from studies.sweep.own_files import Given, given_files, load_given
from studies.sweep.tasks import CaseTask, Task, do
from studies.sweep.workers import done_or_dead

COMPILED = "NUMBA_CACHE_DIR"
"""Where the user may want compiled code."""
ONE_THREAD = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Every process computes on one core: the cores are shared out by cases, not inside them."""
POLL_SECONDS = 0.2


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
    on_death: Callable[[Task, str], object] = Task.store_failure,
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


def environment(portable: bool = False) -> dict[str, str]:
    """Variables of processes that do pieces: one thread, the caches of this process wherever they work; portable: the
    settings of studies.base.portable."""
    wanted = {**dict.fromkeys(ONE_THREAD, "1"), "ORGANBENCH_CACHE": str(cache_folder().absolute())}
    if os.environ.get(COMPILED):
        wanted[COMPILED] = str(Path(os.environ[COMPILED]).absolute())
    return wanted | (portable_environment() if portable else {})


@contextmanager
def environment_of_workers(portable: bool = False) -> Iterator[None]:
    """Inside, processes that start get these variables."""
    wanted = environment(portable)
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


@dataclass(frozen=True)
class Pool:
    """The engine that is this machine (studies.sweep.engine.Engine)."""

    processes: int
    portable: bool = False

    def __enter__(self) -> "Pool":
        return self

    def __exit__(self, *error: object) -> None:
        """Its processes end with each sweep."""

    def perform(
        self,
        tasks: Sequence[Task],
        progress: Progress,
        on_compile: Told,
        on_death: Callable[[Task, str], object],
    ) -> None:
        """As every engine."""
        files = given_files(task.work for task in tasks if isinstance(task, CaseTask))
        with environment_of_workers(self.portable), told_by_workers(on_compile) as writer:
            perform(list(tasks), self.processes, progress, writer=writer, files=files, on_death=on_death)

    def measure(self, root: Path, study: Study, progress: Progress, on_compile: Told, among: set[Path] | None) -> int:
        """As every engine: in this process."""
        return measure_times(root, study, progress, on_compile, among)
