"""The second phase of a sweep: frame times, measured by one process with nothing beside it."""

from collections.abc import Callable
from pathlib import Path

from studies.base.compile_watch import watching
from studies.catalog.study import Study
from studies.runs.case import Case
from studies.runs.current import case_path
from studies.store.archived import check_no_archive
from studies.sweep.executor import Progress, Told
from studies.sweep.stored.known import Known
from studies.timing.alone import alone
from studies.timing.cases import time_cases


def measure_times(root: Path, study: Study, progress: Progress, on_compile: Told, among: set[Path] | None) -> int:
    """Times what is not timed yet, of `among` where given, when no other command does; how many that were."""

    def pending() -> list[Case]:
        known = Known(root)
        return [
            case
            for case in study.cases
            if case.timed and known.can_be_timed(study.name, case) and known.why_untimed(study.name, case) is not None
            if among is None or case_path(root, study.name, case) in among
        ]

    return _measured(root, study, progress, on_compile, pending)


def measure_again(root: Path, study: Study, progress: Progress, on_compile: Told) -> int:
    """Times again on this machine all that is stored and current, and runs none of it; how many that were. Older times
    of a case stay until the newer ones are whole. Raises StudyError for a root that is an archive."""
    check_no_archive(root)
    return _measured(root, study, progress, on_compile, lambda: timed_again(Known(root), study))


def timed_again(known: Known, study: Study) -> list[Case]:
    """The cases that `measure_again` times: those of which a run of this code is stored that came to its end."""
    timed = [case for case in study.cases if case.timed and known.can_be_timed(study.name, case)]
    return [case for case in timed if known.why_case_is_stale(study.name, case) is None]


def _measured(root: Path, study: Study, progress: Progress, on_compile: Told, pending: Callable[[], list[Case]]) -> int:
    if not pending():
        return 0
    with alone(root), watching(on_compile):
        left = pending()  # another command may have done it meanwhile
        if left:
            progress.begin("timing", len(left))
            time_cases(root, study.name, left, lambda name: progress.advance("timing", name))
    return len(left)
