"""What a client has done by the processes of workers: to prove that they are fit, and jobs."""

import os
import platform
import secrets
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import psutil

from studies.base.atomic import is_there, part_path, write_whole
from studies.base.errors import StudyError
from studies.base.processes import sendable
from studies.catalog.study import Study
from studies.reference.reference_solves import reference_fingerprint
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


def prepare(folder: str, files: tuple[Given, ...]) -> None:
    """Before any request: goes to the folder in which the client was started, where there is one, so that cases find
    their files, and loads the user's files. Raises StudyError."""
    if Path(folder).is_dir():
        os.chdir(folder)
    load_given(files)


def identity(files: tuple[Given, ...] = ()) -> dict[str, str]:
    """What must be equal in all processes that work on one folder, by the words for it in a sentence; `files`: of the
    user, each with the modules next to it."""
    code = {"the code of organbench": run_fingerprint() + reference_fingerprint(), "Python": platform.python_version()}
    packages = {name: version or "none" for name, version in this_machine().packages.items()}
    own = {f"the modules next to {path}": read_code(Path(path), content).fingerprint for path, content in files}
    return code | packages | own


def check(token: Path, content: str, ours: dict[str, str], files: tuple[Given, ...]) -> tuple[str, str]:
    """Id of the machine, and what is wrong with a worker: the end of a sentence that begins with its name, or "".

    token: a file in the results folder, in which the client has just written `content`; ours: its identity. Raises
    StudyError where nothing can be written to the folder."""
    if not is_there(token) or token.read_text(encoding="utf-8") != content:
        return machine_id(), f"does not see {token.parents[1]}; put the results on a folder that every worker shares"
    trial = part_path(token)
    write_whole(trial, b"")
    trial.unlink()
    for name, theirs in identity(files).items():
        if theirs != ours.get(name) and name in this_machine().packages | {"Python": None}:
            other = f"has {name} {theirs}, and this machine has {ours.get(name)}; install the same version there"
            return machine_id(), other
        if theirs != ours.get(name):
            return machine_id(), f"differs in {name}; put the same version there, and start the worker again"
    return machine_id(), ""


@contextmanager
def check_for(root: Path, files: tuple[Given, ...]) -> Iterator[Callable[[], tuple[str, str]]]:
    """The check of workers that are to write below `root`; its file is gone afterwards. Raises StudyError where it
    cannot be written."""
    content = secrets.token_hex(16)
    token = root / "cache" / f"shared-{content[:8]}"
    write_whole(token, content.encode())
    try:
        yield partial(check, token, content, identity(files), files)
    finally:
        token.unlink(missing_ok=True)


def do_job(job: Job) -> Exception | None:
    """Does a job of a sweep, unless its result is there: a job whose worker was lost may be done. What it raised, which
    Dask would take for a reason to try again."""
    try:
        do(job)
    except MemoryError:
        raise
    except Exception as error:
        return sendable(error)
    return None


def time_study(root: Path, study: Study, among: set[Path] | None) -> tuple[int, float]:
    """Measures the frame times of the cases of a study that this machine has not timed: how many those were, and the
    share of its processors that others kept busy just before."""
    busy = psutil.cpu_percent(WATCHED) / 100
    return measure_times(Ledger(root), study, Silent(), lambda name: None, among), busy


def wait_until_seen(paths: Iterable[Path], seconds: float = SIGHT_SECONDS) -> None:
    """Returns when all the files, which other machines have written, are seen here. Raises StudyError when they are
    not in so many seconds."""
    until = time.monotonic() + seconds
    while missing := [path for path in paths if not is_there(path)]:
        if time.monotonic() > until:
            raise StudyError(
                f"{missing[0]} was written by a worker and is not seen here after {seconds:g} s: the results must lie "
                "on a folder that every worker shares"
            )
        for folder in {path.parent for path in missing if path.parent.is_dir()}:
            os.listdir(folder)  # asks the server of a network folder again
        time.sleep(min(1.0, seconds / 10))
