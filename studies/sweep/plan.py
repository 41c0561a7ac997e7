"""What a sweep would run, why, how long that may take, from the seconds that stored results carry, and its size."""

import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.reference.reference_solves import ReferenceSolve
from studies.runs.case import Case
from studies.runs.size import record_bytes, timing_bytes
from studies.store.index.entry import Entry
from studies.sweep.frame_times import timed_again
from studies.sweep.stored.estimate import predicted, rates, timing_seconds
from studies.sweep.stored.known import Known
from studies.sweep.tasks import REFERENCE, Task, tasks_of

PHYSICS, TIMING = "physics", "timing"
"""The stages: the first in several processes, the second alone."""


AGAIN = "asked for again"
"""Why stored cases are timed though their times are current."""


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
    size: int | None = None
    """Bytes that it will store: as then, else from what a case records; None of a reference that is not stored."""
    guess: float = 0.0
    """Seconds by its size and a rate (studies.sweep.stored.estimate), which count where it has not run."""
    here: bool = False
    """Whether that rate is one of this machine."""


def plan(
    root: Path, study: Study, wanted: Callable[[Task], bool] | None = None, known: Known | None = None
) -> list[Planned]:
    """What `run_studies` would run of a study, in its order; `wanted` as there."""
    known, tasks = known or Known(root), tasks_of(root, [study])
    chosen = [task for task in tasks if _runs(task, wanted, known)]
    measured = rates(known, tasks) if chosen else {}
    found = [_of_task(task, known, measured) for task in chosen]
    runs = {piece.label for piece in found}
    for case in study.cases:
        if not case.timed or (wanted is not None and case.name not in runs):
            continue
        why = known.why_untimed(study.name, case)
        if why is not None and (known.can_be_timed(study.name, case) or case.name in runs):
            found.append(_of_timing(study, case, why, known, measured))
    return found


def plan_again(root: Path, study: Study) -> list[Planned]:
    """What `measure_again` would time of a study, in its order."""
    known = Known(root)
    measured = rates(known, tasks_of(root, [study]))
    return [_of_timing(study, case, AGAIN, known, measured) for case in timed_again(known, study)]


def kind_of(stage: str, label: str) -> str:
    """ "reference", "case" or "timing", by the stage and the label of a task."""
    return TIMING if stage == TIMING else "reference" if label.startswith(REFERENCE) else "case"


def _runs(task: Task, wanted: Callable[[Task], bool] | None, known: Known) -> bool:
    return known.why_stale(task) is not None if wanted is None else wanted(task)


def _of_task(task: Task, known: Known, measured: Mapping[str, float]) -> Planned:
    why = known.why_stale(task) or "its result is a failure"
    seconds, size = _cost(known.entry(task))
    kind = "reference" if isinstance(task.work, ReferenceSolve) else "case"
    guess = 0.0 if seconds is not None else predicted(task) * measured.get(kind, 1.0)
    if not isinstance(task.work, ReferenceSolve):
        size = size or record_bytes(task.work)
    return Planned(PHYSICS, kind, task.label, why, seconds, size, guess, kind in measured)


def _of_timing(study: Study, case: Case, why: str, known: Known, measured: Mapping[str, float]) -> Planned:
    seconds, size = _cost(known.of_timing(study.name, case))
    guess = 0.0 if seconds is not None else timing_seconds(case) * measured.get("case", 1.0)
    return Planned(TIMING, TIMING, case.name, why, seconds, size or timing_bytes(case), guess, "case" in measured)


def _cost(entry: Entry | None) -> tuple[float | None, int | None]:
    """Seconds and bytes of a file; nothing of one that cannot be read."""
    return (None, None) if entry is None or entry.fault else (entry.seconds, entry.size)


def expected(found: Sequence[Planned], jobs: int) -> float:
    """Seconds that `found` takes in `jobs` processes, timing alone: what each took, or would by its size."""
    shared = {PHYSICS: jobs, TIMING: 1}
    return sum((piece.guess if piece.seconds is None else piece.seconds) / shared[piece.stage] for piece in found)


def expected_bytes(found: Sequence[Planned]) -> tuple[int, int]:
    """What `found` will store, and how many of it are not in that, because nothing is known of their size. A reference
    counts as the mean of those that are known."""
    sizes = [piece.size for piece in found if piece.size is not None]
    references = [piece.size for piece in found if piece.kind == "reference" and piece.size is not None]
    unknown = len(found) - len(sizes)
    if references:
        return sum(sizes) + unknown * sum(references) // len(references), 0
    return sum(sizes), unknown


def free_bytes(folder: Path) -> int:
    """Of the disk on which a folder lies, or will lie. Raises StudyError where that cannot be told."""
    there = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.exists())
    try:
        return shutil.disk_usage(there).free
    except OSError as problem:
        raise StudyError(f"{there} does not tell how much room it has ({problem.strerror})") from problem
