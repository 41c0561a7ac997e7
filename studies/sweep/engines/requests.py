"""What a client asks the processes of workers: whether they are fit, and to do jobs."""

import os
import platform
import secrets
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil

from studies.base.atomic import is_there, part_path, write_whole
from studies.base.errors import StudyError
from studies.base.processes import sendable
from studies.catalog.study import Study
from studies.reference.reference_solves import reference_fingerprint
from studies.runs.case import Case
from studies.runs.current import run_fingerprint
from studies.runs.user_code import Given, load_given, read_code
from studies.store.ledger import Ledger
from studies.store.machine import machine_id, this_machine
from studies.sweep.executor import Silent
from studies.sweep.frame_times import measure_times
from studies.sweep.job import Job, do

SIGHT_SECONDS = 60.0
"""In which a file that another machine has written must be seen: network folders remember for half a minute what was
not there."""
WATCHED = 1.0
"""Seconds for which a machine is watched before frame times are measured."""


@dataclass(frozen=True)
class Preparation:
    """What a process needs before any request."""

    folder: str
    """In which the client was started."""
    files: tuple[Given, ...]
    """Of the user."""

    def prepare(self) -> None:
        """Goes to that folder where there is one, so that cases find their files, and loads the user's files. Raises
        StudyError."""
        if Path(self.folder).is_dir():
            os.chdir(self.folder)
        load_given(self.files)


def identity(files: tuple[Given, ...] = ()) -> dict[str, str]:
    """What must be equal in all processes that work on one folder, by the words for it in a sentence; `files`: of the
    user, each with the modules next to it."""
    code = {"the code of organbench": run_fingerprint() + reference_fingerprint(), "Python": platform.python_version()}
    packages = {name: version or "none" for name, version in this_machine().packages.items()}
    own = {f"the modules next to {path}": read_code(Path(path), content).fingerprint for path, content in files}
    return code | packages | own


@dataclass(frozen=True)
class Check:
    """Whether a worker is fit."""

    token: Path
    """A file in the results folder, which the client has just written."""
    content: str
    ours: dict[str, str]
    files: tuple[Given, ...]

    def answer(self) -> tuple[str, str]:
        """Id of the machine, and what is wrong: the end of a sentence that begins with the worker's name, or "".

        Raises StudyError where nothing can be written to the folder."""
        return machine_id(), self.fault()

    def fault(self) -> str:
        """What is wrong here; "" when nothing is."""
        if not is_there(self.token) or self.token.read_text(encoding="utf-8") != self.content:
            return f"does not see {self.token.parents[1]}; put the results on a folder that every worker shares"
        trial = part_path(self.token)
        write_whole(trial, b"")
        trial.unlink()
        for name, theirs in identity(self.files).items():
            ours = self.ours.get(name)
            if theirs != ours and name in this_machine().packages | {"Python": None}:
                return f"has {name} {theirs}, and this machine has {ours}; install the same version there"
            if theirs != ours:
                return f"differs in {name}; put the same version there, and start the worker again"
        return ""


@contextmanager
def check_for(root: Path, files: tuple[Given, ...]) -> Iterator[Check]:
    """The check of workers that are to write below `root`; its file is gone afterwards. Raises StudyError where it
    cannot be written."""
    content = secrets.token_hex(16)
    token = root / "cache" / f"shared-{content[:8]}"
    write_whole(token, content.encode())
    try:
        yield Check(token, content, identity(files), files)
    finally:
        token.unlink(missing_ok=True)


@dataclass(frozen=True)
class DoJob:
    """A job of a sweep."""

    job: Job

    def answer(self) -> Exception | None:
        """Does it, unless its result is there: a job whose worker was lost may be done. What it raised, which Dask
        would take for a reason to try again."""
        try:
            do(self.job)
        except MemoryError:
            raise
        except Exception as error:
            return sendable(error)
        return None


@dataclass(frozen=True)
class FrameTimes:
    """The frame times of a study on the machine that answers."""

    root: Path
    study: str
    cases: tuple[Case, ...]
    among: frozenset[Path] | None

    def answer(self) -> tuple[int, float]:
        """How many cases it timed, and the share of the machine's processors that others kept busy just before."""
        busy = psutil.cpu_percent(WATCHED) / 100
        study = Study(self.study, "", self.cases, (), ())
        among = None if self.among is None else set(self.among)
        return measure_times(Ledger(self.root), study, Silent(), lambda name: None, among), busy


def wait_until_seen(paths: Iterable[Path], seconds: float = SIGHT_SECONDS) -> None:
    """Returns when all the files, which other machines have written, are seen here. Raises StudyError when they are
    not in so many seconds."""
    until = time.monotonic() + seconds
    missing = [path for path in paths if not is_there(path)]
    while missing:
        if time.monotonic() > until:
            raise StudyError(
                f"{missing[0]} was written by a worker and is not seen here after {seconds:g} s: the results must lie "
                "on a folder that every worker shares"
            )
        time.sleep(min(1.0, seconds / 10))
        for folder in {path.parent for path in missing if path.parent.is_dir()}:
            os.listdir(folder)  # asks the server of a network folder again
        missing = [path for path in missing if not is_there(path)]
