"""Opening a results file: whatever is wrong with it is one sentence, and comes to an end."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

from studies.base.atomic import is_there
from studies.base.errors import DamagedFile, OtherVersion, StudyError
from studies.store.checksums import Seal, seal_of

AGAIN = "delete it, or run its study again, which replaces it"
PATIENCE = 30.0
"""Seconds after which a file that has changed is held to be one that the library never finishes."""


@contextmanager
def open_results(path: Path) -> Iterator[tuple[h5py.File, bool]]:
    """The HDF5 file read-only, and whether every byte is as it was written; inside, only reading may fail.

    Raises StudyError when there is no file or it may not be read, OtherVersion for another layout, and DamagedFile for
    any error of the library.
    """
    path = Path(path)
    if path.suffix == ".h5" and is_there(path) and not path.is_file():
        raise DamagedFile(f"{path} is no file but in the place of one: delete it, and run its study again")
    if not is_there(path) or not path.is_file():
        raise StudyError(f"there is no results file {path}: `organbench status` says which cases are stored")
    try:
        seal = seal_of(path)
        _check(path, seal)
        with _without_lock(path) as file:
            yield file, seal is Seal.WHOLE
    except StudyError:
        raise
    except PermissionError as problem:
        raise StudyError(f"{path} may not be read by this user: change its permissions") from problem
    except Exception as problem:  # a damaged file brings HDF5, h5py and numpy to errors of every type
        raise DamagedFile(_sentence(path, "is cut off or damaged")) from problem


def _without_lock(path: Path) -> h5py.File:
    """Stored files never change, so no lock is needed; some network folders cannot give one. A file that this process
    already has open, as by a link of the study's index, is opened as it is open there."""
    try:
        return h5py.File(path, "r", locking=False)
    except OSError as problem:
        if "locking flag values don't match" not in str(problem):
            raise
        return h5py.File(path, "r")


def _check(path: Path, seal: Seal) -> None:
    if seal is Seal.NONE:
        raise OtherVersion(
            f"{path} is an HDF5 file of another program, or of an earlier version of organbench, which stored no "
            "checksums: run its case again, or read it with the version that wrote it"
        )
    if seal is Seal.FOREIGN:
        raise DamagedFile(_sentence(path, "is not an HDF5 file, or was cut off"))
    if seal is Seal.CUT or (seal is Seal.CHANGED and not _comes_to_an_end(path)):
        raise DamagedFile(_sentence(path, "is cut off or damaged"))


def _comes_to_an_end(path: Path) -> bool:
    """Whether another process can read the file (trial_read): the library may crash, or never come back."""
    paths = [str(Path(__file__).parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])]
    try:
        done = subprocess.run(
            [sys.executable, "-m", "studies.store.trial_read", str(path)],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
            capture_output=True,
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def _sentence(path: Path, what: str) -> str:
    return f"{path} {what} ({path.stat().st_size} bytes): {AGAIN}"
