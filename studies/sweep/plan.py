"""What a sweep would run, why, how long that may take, from the seconds that stored results carry, and its size."""

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.reference.reference_solves import ReferenceSolve
from studies.runs.size import record_bytes, timing_bytes
from studies.store.index.entry import Entry
from studies.sweep.frame_times import timed_again
from studies.sweep.stored.known import Known
from studies.sweep.tasks import Task, tasks_of

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


def plan(
    root: Path, study: Study, wanted: Callable[[Task], bool] | None = None, known: Known | None = None
) -> list[Planned]:
    """What `run_studies` would run of a study, in its order; `wanted` as there."""
    known = known or Known(root)
    found = [_of_task(task, known) for task in tasks_of(root, [study]) if _runs(task, wanted, known)]
    runs = {piece.label for piece in found}
    for case in study.cases:
        if not case.timed or (wanted is not None and case.name not in runs):
            continue
        why = known.why_untimed(study.name, case)
        if why is not None and (known.can_be_timed(study.name, case) or case.name in runs):
            seconds, size = _cost(known.of_timing(study.name, case))
            found.append(Planned(TIMING, "timing", case.name, why, seconds, size or timing_bytes(case)))
    return found


def plan_again(root: Path, study: Study) -> list[Planned]:
    """What `measure_again` would time of a study, in its order."""
    known = Known(root)
    found = []
    for case in timed_again(known, study):
        seconds, size = _cost(known.of_timing(study.name, case))
        found.append(Planned(TIMING, "timing", case.name, AGAIN, seconds, size or timing_bytes(case)))
    return found


def _runs(task: Task, wanted: Callable[[Task], bool] | None, known: Known) -> bool:
    return known.why_stale(task) is not None if wanted is None else wanted(task)


def _of_task(task: Task, known: Known) -> Planned:
    why = known.why_stale(task) or "its result is a failure"
    seconds, size = _cost(known.entry(task))
    if isinstance(task.work, ReferenceSolve):
        return Planned(PHYSICS, "reference", task.label, why, seconds, size)
    return Planned(PHYSICS, "case", task.label, why, seconds, size or record_bytes(task.work))


def _cost(entry: Entry | None) -> tuple[float | None, int | None]:
    """Seconds and bytes of a file; nothing of one that cannot be read."""
    return (None, None) if entry is None or entry.fault else (entry.seconds, entry.size)


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
