"""Who runs the jobs of a sweep: processes here (studies.sweep.local) or on a cluster (studies.sweep.engines)."""

from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Protocol

from studies.catalog.study import Study
from studies.store.ledger import Ledger
from studies.sweep.job import Job

CompileListener = Callable[[str], object]
"""Called with the name of a function that is being compiled, or with what a process does (a Doing), from any
thread."""


class Progress(Protocol):
    """Who wants to know how far a sweep is."""

    def begin(self, what: str, total: int) -> None: ...

    def advance(self, what: str, note: str) -> None: ...


class Silent:
    """Progress that nobody follows."""

    def begin(self, what: str, total: int) -> None: ...

    def advance(self, what: str, note: str) -> None: ...


class Executor(Protocol):
    """Does jobs, each in a process that may die. A context manager: what it began has ended when it is left."""

    def __enter__(self) -> "Executor": ...

    def __exit__(self, *error: object) -> None: ...

    @property
    def processes(self) -> int:
        """Jobs that it does at a time, for estimates."""
        ...

    def map(self, jobs: Sequence[Job], on_compile: CompileListener) -> Generator[tuple[Job, str | None]]:
        """Does the jobs and yields each as it ends: with None, or with the cause where its process died in all tries.

        Raises StudyError before anything runs where a job cannot run, and what a job raises."""
        ...

    def measure(
        self, ledger: Ledger, study: Study, progress: Progress, on_compile: CompileListener, among: set[Path] | None
    ) -> int:
        """Times alone what is not timed yet of a study, of `among` (absolute paths) where given; how many that were."""
        ...
