"""What a client asks the process of a worker to do; each is sent there and answered there."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from studies.base.atomic import is_there, part_path, write_whole
from studies.catalog.study import Study
from studies.engines.identity import Identity, this_identity
from studies.runs.case import Case
from studies.sweep.engine import Silent
from studies.sweep.frame_times import measure_times
from studies.sweep.own_files import Given
from studies.sweep.tasks import Task, do


class Request(Protocol):
    """Something to be done in the process of a worker."""

    def answer(self) -> Any:
        """Does it. Raises StudyError."""
        ...


@dataclass(frozen=True)
class Presence:
    """Who is there, and does it see the results folder?"""

    token: Path
    """A file in it that the client has just written."""
    files: tuple[Given, ...]

    def answer(self) -> tuple[Identity, str | None]:
        """Who it is, and what the file holds: None where it is not seen. Raises StudyError where nothing can be
        written beside it."""
        if not is_there(self.token):
            return this_identity(self.files), None
        trial = part_path(self.token)
        write_whole(trial, b"")
        trial.unlink()
        return this_identity(self.files), self.token.read_text(encoding="utf-8")


@dataclass(frozen=True)
class Piece:
    """A piece of a sweep."""

    task: Task

    def answer(self) -> str:
        """Does it, unless its result is there: a piece whose worker died may be done. The path of the record."""
        return str(do(self.task))


@dataclass(frozen=True)
class FrameTimes:
    """The frame times of a study on the machine that answers."""

    root: Path
    study: str
    cases: tuple[Case, ...]
    among: frozenset[Path] | None

    def answer(self) -> tuple[int, float]:
        """How many cases it timed, and the share of the machine's processors that others kept busy just before."""
        busy = busy_share()
        study = Study(self.study, "", self.cases, (), ())
        among = None if self.among is None else set(self.among)
        return measure_times(self.root, study, Silent(), lambda name: None, among), busy


STAT = Path("/proc/stat")
WATCHED = 1.0
"""Seconds for which a machine is watched before frame times are measured."""


def busy_share(seconds: float = WATCHED) -> float:
    """Share of the processors' time that anything used, watched for so long while this process waits; NaN where the
    system does not tell."""
    if not STAT.is_file():
        return float("nan")
    before = _ticks()
    time.sleep(seconds)
    idle, total = (after - earlier for after, earlier in zip(_ticks(), before, strict=True))
    return 1.0 - idle / total if total > 0 else float("nan")


def _ticks() -> tuple[int, int]:
    """Ticks that all processors were idle or waited for a disk, and all their ticks (man 5 proc)."""
    numbers = [int(word) for word in STAT.read_text().splitlines()[0].split()[1:]]
    return numbers[3] + numbers[4], sum(numbers[:8])
