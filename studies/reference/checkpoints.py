"""Load paths half-way, beside the record they are to become: a crash costs one load step, not the path."""

import hashlib
import pickle
from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.atomic import is_there, write_whole

if TYPE_CHECKING:
    from reference_fem import Checkpoint

DIGEST = 64
"""Bytes at the head of the file: SHA-256 of the rest, as text."""

if TYPE_CHECKING:
    from reference_fem import Checkpoint


def steps_path(record: Path) -> Path:
    """Where the path half-way to `record` lies."""
    return record.with_suffix(".steps")


def keep(record: Path, stamp: str, checkpoint: "Checkpoint") -> None:
    """Stores how far the path is, whole or not at all; `stamp` says what problem and what code it belongs to."""
    content = pickle.dumps((stamp, checkpoint))
    write_whole(steps_path(record), hashlib.sha256(content).hexdigest().encode() + content)


def kept(record: Path, stamp: str) -> "Checkpoint | None":
    """Where the path of this very problem and code stopped; None when it did not begin, is of another, or its file is
    not as it was written: then the path begins again."""
    file = steps_path(record)
    if not is_there(file):
        return None
    whole = file.read_bytes()
    if hashlib.sha256(whole[DIGEST:]).hexdigest().encode() != whole[:DIGEST]:
        return None
    try:
        stored, checkpoint = pickle.loads(whole[DIGEST:])
    except (pickle.UnpicklingError, AttributeError, EOFError, ImportError, TypeError, ValueError):
        return None  # of another version of the classes
    return checkpoint if stored == stamp else None


def drop(record: Path) -> None:
    """Forgets the path half-way: it has ended."""
    steps_path(record).unlink(missing_ok=True)
