"""What a sweep would run, why, and how long that may take: from the seconds that stored results carry."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.reference.reference_solves import ReferenceSolve
from studies.runs.current import case_fingerprint
from studies.store.record import peek
from studies.store.staleness import why_stale
from studies.sweep.tasks import Task, tasks_of
from studies.timing.cases import can_be_timed, timing_file

PHYSICS, TIMING = "physics", "timing"
"""The stages: the first in several processes, the second alone."""


@dataclass(frozen=True)
class Planned:
    """A piece of work to come."""

    stage: str
    """PHYSICS or TIMING."""
    kind: str
    """ "reference", "case" or "timing"."""
    label: str
    why: str
    seconds: float | None
    """What it took when it last ran [s], without compiling; None where nothing is stored."""


def plan(root: Path, study: Study, wanted: Callable[[Task], bool] | None = None) -> list[Planned]:
    """What `run_studies` would run of a study, in its order; `wanted` as there."""
    todo = [task for task in tasks_of(root, [study]) if (not task.is_current() if wanted is None else wanted(task))]
    found = []
    for task in todo:
        kind = "reference" if isinstance(task.work, ReferenceSolve) else "case"
        found.append(
            Planned(PHYSICS, kind, task.label, task.why_stale() or "its result is a failure", _seconds(task.path()))
        )
    runs = {task.label for task in todo}
    for case in study.cases:
        if not case.timed or (wanted is not None and case.name not in runs):
            continue
        file = timing_file(root, study.name, case)
        why = why_stale(file, case.key, case_fingerprint(case))
        if why is not None and (case.name in runs or can_be_timed(root, study.name, case)):
            found.append(Planned(TIMING, "timing", case.name, why, _seconds(file)))
    return found


def _seconds(path: Path) -> float | None:
    try:
        return peek(path).attributes.get("seconds")
    except StudyError:
        return None


def expected(found: Sequence[Planned], jobs: int) -> float | None:
    """Seconds that `found` takes in `jobs` processes, timing alone. A piece that never ran counts as the mean of its
    kind, or not at all where none of its kind ran; None where none of any kind did."""
    total, known = 0.0, False
    for kind in {piece.kind for piece in found}:
        pieces = [piece for piece in found if piece.kind == kind]
        seconds = [piece.seconds for piece in pieces if piece.seconds is not None]
        if seconds:
            known = True
            total += sum(seconds) / len(seconds) * len(pieces) / (1 if pieces[0].stage == TIMING else jobs)
    return total if known else None
