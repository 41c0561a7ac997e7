"""A study from start to end: what is stale runs, the rest stays; references and physics in parallel, timing alone."""

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path

from studies.base.atomic import write_whole
from studies.base.errors import OpenElsewhere
from studies.catalog.study import Study
from studies.store.archived import check_no_archive
from studies.store.ledger import Ledger
from studies.store.opening import check_not_open
from studies.sweep.executor import CompileListener, Executor, Progress
from studies.sweep.job import Job, jobs_of
from studies.sweep.local import Local


@dataclass
class Failures:
    """What failed in a sweep because its process died or its file cannot be written, with the cause."""

    causes: dict[str, str] = field(default_factory=dict)
    """Label of a job -> why."""

    def add(self, job: Job, cause: str) -> None:
        """Notes a job and stores it as failed. Raises StudyError when it cannot be stored."""
        self.causes[job.label] = cause
        job.store_failure(cause)

    def can_store(self, job: Job) -> bool:
        """Whether the file of a job can be written; notes as the cause of a failure that a folder lies in its place, or
        that another program has it open."""
        path = job.path
        if path.is_dir():
            self.causes[job.label] = f"{path} is a folder where a file belongs: delete it"
            return False
        try:
            if path.is_file():
                check_not_open(path)
        except OpenElsewhere as problem:
            self.causes[job.label] = str(problem)
            return False
        return True

    def sentence(self, again: str) -> str:
        """All of them in one sentence; again: the command that tries them once more."""
        (label, cause), *others = self.causes.items()
        more = f", and {len(others)} more" if others else ""
        return f"failed: {label} ({cause}){more}; all others are done, `{again}` retries"


def run_studies(
    root: Path,
    studies: list[Study],
    jobs: int | Executor,
    progress: Progress,
    selection: Callable[[Job], bool] | None = None,
    on_compile: CompileListener = lambda name: None,
    failures: Failures | None = None,
    ledger: Ledger | None = None,
) -> int:
    """Brings the studies up to date below `root`; the number of pieces that had to run.

    `jobs`: so many processes of this machine, or an executor. `selection` replaces the rule "what is not current".
    `on_compile` hears what is being compiled, from any thread. `failures` hears of jobs whose process died, which are
    stored as failed, and of those that do not run because a folder lies in the place of their file. `ledger`: of
    `root`, where the command has one. Another command may work on the same folder. Raises StudyError when results
    cannot be written, and for a root that is an archive.
    """
    check_no_archive(root)
    root = root.absolute()
    executor, ledger = Local(jobs) if isinstance(jobs, int) else jobs, ledger or Ledger(root)
    rule = selection or (lambda job: ledger.why(job) is not None)
    ledger.look_again()
    stored = [(job, ledger.entry(job)) for job in jobs_of(root, studies) if rule(job)]
    todo = [replace(job, initial_state=entry and entry.state) for job, entry in stored]
    failures = failures or Failures()
    if todo:
        check_writable(root)
        storable = [job for job in todo if failures.can_store(job)]
        if storable:
            progress.begin("physics", len(storable))
        with closing(executor.map(storable, on_compile)) as ended:  # Ctrl-C ends its processes; what is stored stays
            for job, cause in ended:
                if cause is not None:
                    failures.add(job, cause)
                progress.advance("physics", job.label)
    among = None if selection is None else {job.path for job in todo}
    measured = sum(executor.measure(ledger, study, progress, on_compile, among) for study in studies)
    ledger.look_again()
    return len(todo) + measured


def check_writable(root: Path) -> None:
    """Raises StudyError before minutes are spent on results that could not be stored."""
    trial = root / ".trial"
    write_whole(trial, b"")
    trial.unlink(missing_ok=True)  # another run of this command may have been faster
