"""Checks that a packed or unpacked archive is unchanged."""

import hashlib
import os
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import IO

from studies.base.errors import DamagedFile, StudyError
from studies.store.archived import MANIFEST

AGAIN = "get the archive again"
LARGEST = 50_000_000
"""Bytes of a manifest: half a million files."""
ENCRYPTED = 1
"""Of the flags of a file in a zip."""
BROKEN = (zipfile.BadZipFile, zlib.error, EOFError)


def check(path: Path) -> int:
    """Compares every file of a zip, or of a folder that one was unpacked to, with its checksum; returns the number of
    files.

    Additional files in a folder are ignored; only regular files of the folder are opened, and nothing is unpacked.
    Raises StudyError for a file that is no archive or is encrypted, DamagedFile with the first file that is missing,
    has changed, or has a path outside the archive.
    """
    if path.is_dir():
        return _compare(path, lambda name: _of_folder(path, name))
    if not path.is_file():
        raise StudyError(f"there is no archive {path}; give the zip file, or the folder that it was unpacked to")
    try:
        with zipfile.ZipFile(path) as archive:
            if any(entry.flag_bits & ENCRYPTED for entry in archive.infolist()):
                raise StudyError(f"{path} is encrypted: unpack it with its password, and check the folder")
            return _compare(path, archive.open)
    except (*BROKEN, NotImplementedError) as problem:
        raise DamagedFile(f"{path} is cut off or damaged ({problem}): {AGAIN}") from problem


def _of_folder(folder: Path, name: str) -> IO[bytes]:
    """Opens a regular file of a folder. A pipe or a device, or a link to one, could be read without end."""
    file = folder / name
    if file.exists() and not file.is_file():
        raise DamagedFile(f"{folder}: {name} is not a regular file: {AGAIN}")
    if not Path(os.path.realpath(file)).is_relative_to(os.path.realpath(folder)):
        raise DamagedFile(f"{folder}: {name} is a link that leads outside: {AGAIN}")
    return open(file, "rb")


def _compare(path: Path, opened: Callable[[str], IO[bytes]]) -> int:
    expected = _manifest(path, opened)
    for name, checksum in expected.items():
        try:
            with opened(name) as file:
                found = hashlib.file_digest(file, "sha256").hexdigest()  # pyright: ignore[reportArgumentType]
        except (KeyError, FileNotFoundError) as problem:
            raise DamagedFile(f"{path} lacks {name}: {AGAIN}") from problem
        except (*BROKEN, OSError) as problem:
            raise DamagedFile(f"{path}: {name} cannot be read ({problem}): {AGAIN}") from problem
        if found != checksum:
            raise DamagedFile(f"{path}: {name} has changed since it was packed: {AGAIN}")
    return len(expected)


def _manifest(path: Path, opened: Callable[[str], IO[bytes]]) -> dict[str, str]:
    """Name -> SHA-256 of every file that was packed."""
    try:
        with opened(MANIFEST) as file:
            content = file.read(LARGEST + 1)  # a zip of 50 MB of line ends is 50 kB
    except (KeyError, FileNotFoundError) as problem:
        raise StudyError(f"{path} is not an archive of organbench: it has no {MANIFEST}") from problem
    except OSError as problem:
        raise StudyError(f"{path / MANIFEST} cannot be read ({problem.strerror}): change its permissions") from problem
    if len(content) > LARGEST:
        raise DamagedFile(f"{path}: {MANIFEST} has more than {LARGEST / 1e6:.0f} MB: {AGAIN}")
    expected = dict[str, str]()
    for line in content.decode("utf-8", errors="replace").splitlines():
        checksum, separator, name = line.partition("  ")
        if not separator or len(checksum) != 64 or name in expected:
            raise DamagedFile(f"{path}: {MANIFEST} has changed since it was packed: {AGAIN}")
        place = PurePosixPath(name)
        if place.is_absolute() or ".." in place.parts or place.as_posix() != name or name == ".":
            raise DamagedFile(
                f"{path}: {MANIFEST} names {name!r}, which lies outside: it is not an archive of organbench"
            )
        expected[name] = checksum
    return expected
