"""The pieces of work that studies are made of."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from studies.base.atomic import is_there
from studies.base.collection import uncollected
from studies.catalog.study import Study
from studies.reference.reference_solves import ReferenceSolve, reference_solves
from studies.runs.case import Case
from studies.runs.current import case_path, why_case_is_stale
from studies.runs.digest import case_digest

REFERENCE = "reference "
"""Before the name of a reference solution in its label."""


@dataclass(frozen=True)
class Task:
    """One piece of work that can run in any process: a piece of a reference, or a case."""

    root: Path
    study: str
    work: Case | ReferenceSolve
    seen: tuple[int, ...] | None = field(default=None, compare=False)
    """State of its file when it was found that it must run; None where there was none."""

    @property
    def weight(self) -> float:
        """Longest first keeps both cores busy to the end: references by mesh, then cases by size over step."""
        if isinstance(self.work, ReferenceSolve):
            return 1e9 + self.work.weight
        return self.work.body.nodes / self.work.dt_fraction

    @property
    def label(self) -> str:
        """For progress and messages."""
        return REFERENCE + self.work.name if isinstance(self.work, ReferenceSolve) else self.work.name

    def is_current(self) -> bool:
        """Whether it need not run."""
        return self.why_stale() is None

    def why_stale(self) -> str | None:
        """Why it must run (again) (studies.store.staleness); None when it need not."""
        if isinstance(self.work, ReferenceSolve):
            return self.work.why_stale(self.root)
        return why_case_is_stale(self.root, self.study, self.work)

    def state(self) -> tuple[int, ...] | None:
        """What tells its file from any later one; None where there is none."""
        if not is_there(self.path()):
            return None
        found = self.path().stat()
        return found.st_ino, found.st_size, found.st_mtime_ns

    def done_meanwhile(self) -> bool:
        """Whether another command has stored its result since it was found that it must run."""
        return self.state() != self.seen and self.is_current()

    def path(self) -> Path:
        """Where its record lies."""
        return (
            self.work.path(self.root)
            if isinstance(self.work, ReferenceSolve)
            else case_path(self.root, self.study, self.work)
        )


@uncollected()
def tasks_of(root: Path, studies: Iterable[Study]) -> list[Task]:
    """Everything the studies need, each piece once, longest first."""
    tasks: dict[object, Task] = {}
    for study in studies:
        for solve in (solve for scene in study.scenes for solve in reference_solves(scene)):
            tasks[solve.path(root)] = Task(root, study.name, solve)
        for case in study.cases:
            tasks[study.name, case_digest(case)] = Task(root, study.name, case)
    return sorted(tasks.values(), key=lambda task: -task.weight)
