"""What is stored below a results folder: the one place that says whether a result is there and current.

Nothing of it is kept on disk: the head of a file takes 5 ms to read and check, and 1 ms more for each megabyte, so a
command over a thousand results begins within six seconds, and no copy can say anything but what the files say.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Protocol

from studies.base.atomic import is_there
from studies.base.errors import StudyError
from studies.store.entry import Entry, read_entry, why_entry_is_stale
from studies.store.machine import machine_id
from studies.store.paths import SUFFIX, TIMING, index_path, study_folder, timing_name
from studies.store.schema import COMPARABLE, Status

FAILURES = (Status.FAILED, Status.NOT_CONVERGED, Status.TIMED_OUT)
"""Endings that another run may improve."""


class Result(Protocol):
    """The properties of a job (studies.sweep.job) by which the ledger finds its result."""

    @property
    def path(self) -> Path: ...

    @property
    def digest(self) -> str: ...

    @property
    def fingerprint(self) -> str: ...


class Ledger:
    """The stored results below `root`, each file as it is at its first use, or the first after `look_again`.

    A command opens one and passes it on. Its methods raise StudyError for a folder that may not be entered.
    """

    def __init__(self, root: Path) -> None:
        self.root = Path(root)
        self._entries: dict[Path, Entry | None] = {}

    def at(self, path: Path) -> Entry | None:
        """A results file, whatever is in it; None where there is none."""
        if path not in self._entries:
            self._entries[path] = read_entry(path) if is_there(path) else None
        return self._entries[path]

    def files(self, study: str) -> dict[str, Entry]:
        """The results files of a study (or "reference") by name, sorted; timing files too."""
        folder, index = study_folder(self.root, study), index_path(self.root, study)
        try:
            paths = sorted(path for path in folder.iterdir() if path.name.endswith(SUFFIX) and path != index)
        except (FileNotFoundError, NotADirectoryError):
            return {}
        except OSError as problem:
            reason = problem.strerror or str(problem)
            raise StudyError(
                f"{folder} cannot be looked at ({reason}): change the permissions of its folder"
            ) from problem
        # A link that leads to itself, or a file that was removed meanwhile, is no file.
        return {path.name: entry for path in paths if (entry := self.at(path)) is not None}

    def look_again(self) -> None:
        """Files may have changed: each is read again at its next use."""
        self._entries.clear()

    def entry(self, job: Result) -> Entry | None:
        return self.at(job.path)

    def why(self, job: Result) -> str | None:
        """Why a job must run (again) (studies.store.entry); None when its result is there and current."""
        return why_entry_is_stale(self.entry(job), job.digest, job.fingerprint)

    def timing(self, job: Result, machine: str | None = None) -> Entry | None:
        """The file with the frame times of a case by a machine, this one by default."""
        return self.at(job.path.with_name(timing_name(job.path.name, machine or machine_id())))

    def can_be_timed(self, job: Result) -> bool:
        entry = self.entry(job)
        return entry is not None and entry.status in COMPARABLE

    def why_untimed(self, job: Result) -> str | None:
        """Why this machine must time a case (again), were it to be timed; None when it need not."""
        return why_entry_is_stale(self.timing(job), job.digest, job.fingerprint)

    def timed_somewhere(self, job: Result) -> bool:
        """Whether any machine has timed a case with this code, or none ever will, for it broke off."""
        timings = map(self.at, job.path.parent.glob(f"{job.path.stem}{TIMING}*{SUFFIX}"))
        current = any(why_entry_is_stale(entry, job.digest, job.fingerprint) is None for entry in timings)
        return current or not self.can_be_timed(job)

    def state(self, jobs: Iterable[Result]) -> str:
        """The files of jobs with sizes and times, as text: a copy of the folder has the same."""
        entries = ((job, self.entry(job)) for job in jobs)
        return "\n".join(entry.written if entry else f"{job.path.name} -" for job, entry in entries)
