"""Load paths half-way, beside the record they are to become: a crash costs one load step, not the path."""

import pickle
from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.atomic import write_whole

if TYPE_CHECKING:
    from reference_fem import Checkpoint


def steps_path(record: Path) -> Path:
    """Where the path half-way to `record` lies."""
    return record.with_suffix(".steps")


def keep(record: Path, stamp: str, checkpoint: "Checkpoint") -> None:
    """Stores how far the path is, whole or not at all; `stamp` says what problem and what code it belongs to."""
    write_whole(steps_path(record), pickle.dumps((stamp, checkpoint)))


def kept(record: Path, stamp: str) -> "Checkpoint | None":
    """Where the path of this very problem and code stopped; None when it did not begin, or is of another."""
    file = steps_path(record)
    if not file.exists():
        return None
    try:
        said, checkpoint = pickle.loads(file.read_bytes())
    except (pickle.UnpicklingError, AttributeError, EOFError, ImportError, TypeError, ValueError):
        return None  # of another version of the classes: the path begins again
    return checkpoint if said == stamp else None


def drop(record: Path) -> None:
    """Forgets the path half-way: it has ended."""
    steps_path(record).unlink(missing_ok=True)
