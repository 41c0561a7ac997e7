"""Jobs of a sweep in processes of this machine."""

import os
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from numba.core import event

from studies.base.compile_watch import EVENT, CompileWatch
from studies.base.doing import HEARING
from studies.base.processes import Tell, run_each
from studies.catalog.study import Study
from studies.geometry.mesher.jobs import cache_folder
from studies.geometry.mesher.shipped import OWN
from studies.runs.user_code import Given, given_files, load_given
from studies.store.ledger import Ledger
from studies.sweep.executor import CompileListener, Progress
from studies.sweep.frame_times import measure_times
from studies.sweep.job import CaseJob, Job, do

COMPILED = "NUMBA_CACHE_DIR"
"""Variable with the user's folder for compiled code."""
ONE_THREAD = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Every process computes on one core: the cores are shared out by cases, not inside them."""


def begin(files: tuple[Given, ...], tell: Tell) -> None:
    """What every process does first: it loads the user's `files`, and reports what it does and compiles."""
    load_given(files)
    HEARING.append(tell)
    event.register(EVENT, CompileWatch(tell))


def files_for(jobs: Sequence[Job]) -> tuple[Given, ...]:
    return given_files(job.work for job in jobs if isinstance(job, CaseJob))


def environment() -> dict[str, str]:
    """Variables of processes that do jobs: one thread, the caches of this process wherever they work."""
    variables = {**dict.fromkeys(ONE_THREAD, "1"), "ORGANBENCH_CACHE": str(cache_folder().absolute())}
    if os.environ.get(COMPILED):
        variables[COMPILED] = str(Path(os.environ[COMPILED]).absolute())
    return variables | ({OWN: os.environ[OWN]} if OWN in os.environ else {})


@dataclass(frozen=True)
class Local:
    """The executor that is this machine (studies.sweep.executor.Executor)."""

    processes: int

    def __enter__(self) -> "Local":
        return self

    def __exit__(self, *error: object) -> None:
        """Its processes end with each sweep."""

    def map(self, jobs: Sequence[Job], on_compile: CompileListener) -> Generator[tuple[Job, str | None]]:
        prepare = partial(begin, files_for(jobs))
        for ended in run_each(jobs, self.processes, do, prepare, environment(), on_compile):
            yield ended.job, ended.cause

    def measure(
        self, ledger: Ledger, study: Study, progress: Progress, on_compile: CompileListener, among: set[Path] | None
    ) -> int:
        return measure_times(ledger, study, progress, on_compile, among)
