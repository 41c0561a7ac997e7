"""Whether an archive, packed or unpacked, is what was packed."""

import hashlib
import zipfile
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import IO

from studies.base.errors import DamagedFile, StudyError
from studies.store.archived import MANIFEST

AGAIN = "get the archive again"
Opener = Callable[[str], IO[bytes]]


def check(path: Path) -> int:
    """Compares every file of a zip, or of a folder that one was unpacked to, with its checksum; how many there are.

    Files that others added to a folder are left alone. Raises StudyError for what is no archive, DamagedFile with the
    first file that is missing or has changed.
    """
    if path.is_dir():
        return _compare(path, lambda name: open(path / name, "rb"))
    if not path.is_file():
        raise StudyError(f"there is no archive {path}; give the zip file, or the folder that it was unpacked to")
    try:
        with zipfile.ZipFile(path) as archive:
            return _compare(path, archive.open)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError) as problem:
        raise DamagedFile(f"{path} is cut off or damaged ({problem}): {AGAIN}") from problem


def _compare(path: Path, opened: Opener) -> int:
    count = 0
    for name, expected in _entries(path, opened):
        try:
            with opened(name) as file:
                found = hashlib.file_digest(file, "sha256").hexdigest()  # pyright: ignore[reportArgumentType]
        except (KeyError, FileNotFoundError) as problem:
            raise DamagedFile(f"{path} lacks {name}: {AGAIN}") from problem
        except (zipfile.BadZipFile, zlib.error, EOFError, OSError) as problem:
            raise DamagedFile(f"{path}: {name} cannot be read ({problem}): {AGAIN}") from problem
        if found != expected:
            raise DamagedFile(f"{path}: {name} is not what was packed: {AGAIN}")
        count += 1
    return count


def _entries(path: Path, opened: Opener) -> Iterable[tuple[str, str]]:
    """(name, SHA-256) of every file that was packed."""
    try:
        with opened(MANIFEST) as file:
            lines = file.read().decode("utf-8", errors="replace").splitlines()
    except (KeyError, FileNotFoundError) as problem:
        raise StudyError(f"{path} is no archive of organbench: it has no {MANIFEST}") from problem
    for line in lines:
        expected, separator, name = line.partition("  ")
        if not separator or len(expected) != 64:
            raise DamagedFile(f"{path}: {MANIFEST} is not what was packed: {AGAIN}")
        yield name, expected
