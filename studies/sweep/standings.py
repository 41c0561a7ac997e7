"""How every piece of a study stands, by the index of what is stored."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from studies.base.collection import uncollected
from studies.base.counting import amounts, status_counts
from studies.catalog.study import Study
from studies.reference.reference_solves import ReferenceSolve
from studies.store.schema import Status
from studies.store.staleness import MISSING
from studies.sweep.stored.known import FAILURES, Known
from studies.sweep.tasks import Task, tasks_of

CAUSES = 8
"""Of failures that are named one by one."""


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

    @property
    def of_reference(self) -> bool:
        """Whether it is a reference solution, and no case."""
        return isinstance(self.task.work, ReferenceSolve)


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


def summary(found: Sequence[Standing]) -> str:
    """ "9 cases: 7 ok, 2 failed; 6 reference solutions: 6 ok"."""
    groups = {"case": [], "reference": []}
    for standing in found:
        groups["reference" if standing.of_reference else "case"].append(standing.status)
    parts = [f"{amounts(Counter({kind: len(each)}))}: {status_counts(each)}" for kind, each in groups.items() if each]
    return "; ".join(parts) or "no cases"


def unexpected(study: Study, found: Sequence[Standing]) -> list[Standing]:
    """What ended in a way that the study does not expect; what is stale or missing has not ended."""
    ended = [standing for standing in found if standing.status not in ("stale", "missing")]
    references = [s for s in ended if s.of_reference and s.status != Status.OK and not study.counts_losses]
    return [s for s in ended if not s.of_reference and not study.accepts(s.status)] + references


def causes(found: Sequence[Standing]) -> list[str]:
    """A sentence for each distinct cause, with the first label; messages that differ in numbers alone are one."""
    groups: dict[tuple[str, str], list[Standing]] = {}
    for standing in found:
        kind = "".join(letter for letter in standing.message if letter not in "0123456789.e+-")
        groups.setdefault((standing.status, kind), []).append(standing)
    sentences = []
    for (status, _), each in list(groups.items())[:CAUSES]:
        more = f", and {len(each) - 1} more" if len(each) > 1 else ""
        sentences.append(f"{status.replace('-', ' ')}: {each[0].message} ({each[0].task.label}{more})")
    left = len(groups) - CAUSES
    return [*sentences, f"and {left} more causes; `organbench status` names them"] if left > 0 else sentences
