"""How every piece of a study stands, read off the headers of what is stored."""

from dataclasses import dataclass
from pathlib import Path

from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.runs.current import case_path
from studies.store.record import Record, Status, peek
from studies.store.staleness import MISSING
from studies.sweep.tasks import Task, tasks_of


def warnings_of(root: Path, study: Study) -> list[str]:
    """What the cases of a study warned of when they were prepared, a sentence each."""
    records = [stored(case_path(root, study.name, case)) for case in study.cases]
    warnings = [record.attributes.get("warnings", "") for record in records if record is not None]
    return [str(sentence) for sentence in warnings if sentence]


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
