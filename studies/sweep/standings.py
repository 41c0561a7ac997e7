"""How every piece of a study stands, by the index of what is stored."""

from dataclasses import dataclass
from pathlib import Path

from studies.base.collection import uncollected
from studies.catalog.study import Study
from studies.store.staleness import MISSING
from studies.sweep.stored.known import FAILURES, Known
from studies.sweep.tasks import Task, tasks_of


def warnings_of(root: Path, study: Study) -> list[str]:
    """What the cases of a study warned of when they were prepared, a sentence each."""
    known = Known(root)
    entries = [known.of_case(study.name, case) for case in study.cases]
    return [entry.warnings for entry in entries if entry is not None and entry.warnings]


@dataclass(frozen=True)
class Standing:
    """How a piece of work stands."""

    task: Task
    status: str
    """A Status, "stale" or "missing"."""
    message: str


@uncollected()
def standings(root: Path, study: Study, known: Known | None = None) -> list[Standing]:
    """Every piece of a study: ok, failed in some way, stale or missing."""
    known = known or Known(root)
    return [standing_of(task, known) for task in tasks_of(root, [study])]


def standing_of(task: Task, known: Known) -> Standing:
    """How a piece stands."""
    entry, why = known.look(task)
    if entry is None or why is not None:
        return Standing(task, "missing" if why == MISSING else "stale", why or MISSING)
    return Standing(task, entry.status, entry.message)


def failed(task: Task, known: Known | None = None) -> bool:
    """Whether the stored result of a task is no success; a damaged file is stale instead."""
    entry = (known or Known(task.root)).entry(task)
    return entry is not None and entry.status in FAILURES
