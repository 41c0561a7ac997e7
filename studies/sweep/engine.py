"""What does the pieces of a sweep: the processes of this machine, or those of a cluster (studies.engines)."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

from studies.catalog.study import Study
from studies.sweep.tasks import Task

Told = Callable[[str], object]
"""Called with the name of a function that is being compiled."""


class Progress(Protocol):
    """Who wants to know how far a sweep is."""

    def begin(self, what: str, total: int) -> None:
        """A stage of `total` pieces begins."""
        ...

    def advance(self, what: str, note: str) -> None:
        """One piece is done."""
        ...


class Silent:
    """Progress that nobody follows."""

    def begin(self, what: str, total: int) -> None:
        """Nothing is shown."""

    def advance(self, what: str, note: str) -> None:
        """Nothing is shown."""


class Engine(Protocol):
    """Does pieces of work, each in a process of its own that may die. A context manager: what it began has ended when
    it is left."""

    def __enter__(self) -> "Engine":
        """Begins nothing yet."""
        ...

    def __exit__(self, *error: object) -> None:
        """Ends what it began."""
        ...

    @property
    def processes(self) -> int:
        """Pieces that it does at a time, for estimates."""
        ...

    @property
    def portable(self) -> bool:
        """Whether results are to be equal on every x86-64 processor (studies.base.portable)."""
        ...

    def perform(
        self,
        tasks: Sequence[Task],
        progress: Progress,
        on_compile: Told,
        on_death: Callable[[Task, str], object],
    ) -> None:
        """Does the pieces. One whose process dies is tried twice again, then given to `on_death` with the cause, and
        the rest goes on. Raises StudyError before anything runs where a piece cannot run."""
        ...

    def measure(self, root: Path, study: Study, progress: Progress, on_compile: Told, among: set[Path] | None) -> int:
        """Times what is not timed yet of a study, of `among` where given, alone; how many cases that were."""
        ...
