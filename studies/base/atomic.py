"""A file is there whole or not at all, whatever interrupts: full disk, Ctrl-C, kill -9, power cut."""

import errno
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4

from studies.base.errors import StudyError

STALE_SECONDS = 3600.0  # a write takes seconds: a .part this old belongs to a process that was killed


def write_whole(path: Path, content: bytes) -> None:
    """Writes `content` to `path` through a `.part` file next to it: written, flushed to disk, renamed.

    Each writer has its own .part, so two that write the same file do not mix; the last one wins.
    What stood at `path` stays untouched until the rename. Raises StudyError when it cannot be written.
    """
    with part_beside(path, len(content)) as part:
        part.write_bytes(content)


@contextmanager
def part_beside(path: Path, size: int | None = None) -> Iterator[Path]:
    """Inside, a `.part` file to fill, in any way; at the end it is flushed to disk and becomes `path`.

    size: bytes that will be written, where that is known. Raises as write_whole; another error leaves nothing.
    """
    path = Path(path)
    part = part_path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        _flush(part)
        os.replace(part, path)
        if os.name == "posix":  # elsewhere a folder cannot be opened
            _flush(path.parent)
    except OSError as problem:
        raise StudyError(unwritten(path, problem, size)) from problem
    finally:
        _remove(part)


def part_path(path: Path) -> Path:
    """A new name next to `path` that no other writer has, on any host.

    `tempfile` would make files that only their owner may read.
    """
    return path.with_name(f"{path.name}.{uuid4().hex[:12]}.part")


def is_there(path: Path) -> bool:
    """Whether `path` exists; a link that leads nowhere, or to itself, does not. Raises StudyError when that cannot be
    seen, as in a folder that may not be entered."""
    try:
        os.stat(path)
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError as problem:
        if problem.errno == errno.ELOOP:
            return False
        reason = problem.strerror or str(problem)
        raise StudyError(f"{path} cannot be looked at ({reason}): change the permissions of its folder") from problem
    return True


def sweep_parts(folder: Path) -> int:
    """Removes the .part files that killed processes left in `folder`; returns how many."""
    now = time.time()
    old = [part for part in Path(folder).glob("*.part") if now - _modified(part) > STALE_SECONDS]
    for part in old:
        _remove(part)
    return len(old)


def _modified(part: Path) -> float:
    try:
        return part.stat().st_mtime
    except FileNotFoundError:  # renamed by its owner between the listing and now
        return float("inf")


def _remove(part: Path) -> None:
    # Gone already after the rename; and in a folder that refuses, the first error is the one to report.
    try:
        part.unlink()
    except OSError:
        return


def _flush(path: Path) -> None:
    """To the disk: of a file what was written, of a folder its names."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def unwritten(path: Path, problem: OSError, size: int | None = None) -> str:
    """Why a file was not written, and the way out."""
    if problem.errno in (errno.ENOSPC, errno.EDQUOT):
        megabytes = "" if size is None else f" ({size / 1e6:.1f} MB)"
        return (
            f"{path}{megabytes} was not written, the disk is full: free some space and run again; "
            "everything stored before is kept"
        )
    if path.is_dir():
        return f"{path} was not written, a folder has its name: move or delete that folder, and run again"
    reason = problem.strerror or str(problem)
    return (
        f"{path} was not written ({reason}): choose a folder that can be written to; everything stored before is kept"
    )
