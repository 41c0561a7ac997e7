"""The second phase of a sweep: frame times, measured by one process with nothing else running."""

from collections.abc import Callable
from pathlib import Path

from studies.base.compile_watch import watching
from studies.catalog.study import Study
from studies.metrics.timing.alone import alone
from studies.metrics.timing.cases import time_cases
from studies.runs.case import Case
from studies.store.archived import check_no_archive
from studies.store.ledger import Ledger
from studies.sweep.executor import CompileListener, Progress
from studies.sweep.job import CaseJob, case_jobs


def measure_times(
    ledger: Ledger, study: Study, progress: Progress, on_compile: CompileListener, among: set[Path] | None
) -> int:
    """Times what is not timed yet, of `among` (absolute paths) where given, when no other command does; how many that
    were."""

    def pending() -> list[Case]:
        ledger.look_again()
        untimed = [job for job in timed_jobs(ledger, study) if ledger.why_untimed(job) is not None]
        return [job.work for job in untimed if among is None or job.path.absolute() in among]

    return _measured(ledger.root, study, progress, on_compile, pending)


def measure_again(ledger: Ledger, study: Study, progress: Progress, on_compile: CompileListener) -> int:
    """Times again on this machine all that is stored and current, and runs none of it; how many that were. Older times
    of a case stay until the newer ones are whole. Raises StudyError for a root that is an archive."""
    check_no_archive(ledger.root)

    def pending() -> list[Case]:
        ledger.look_again()
        return [job.work for job in timed_again(ledger, study)]

    count = _measured(ledger.root, study, progress, on_compile, pending)
    ledger.look_again()
    return count


def timed_again(ledger: Ledger, study: Study) -> list[CaseJob]:
    """The cases that `measure_again` times: those of which a run of this code is stored that came to its end."""
    return [job for job in timed_jobs(ledger, study) if ledger.why(job) is None]


def timed_jobs(ledger: Ledger, study: Study) -> list[CaseJob]:
    """The cases of a study that are to be timed, and are stored and came to their end."""
    return [job for job in case_jobs(ledger.root, study) if job.work.timed and ledger.can_be_timed(job)]


def _measured(
    root: Path, study: Study, progress: Progress, on_compile: CompileListener, pending: Callable[[], list[Case]]
) -> int:
    if not pending():
        return 0
    with alone(root), watching(on_compile):
        left = pending()  # another command may have done it meanwhile
        if left:
            progress.begin("timing", len(left))
            time_cases(root, study.name, left, lambda name: progress.advance("timing", name))
    return len(left)
