"""Where things lie below the results folder: results/STUDY/NAME-HASH8.h5, its timing files and the study's index."""

import hashlib
import re
from pathlib import Path

from studies.base.errors import StudyError
from studies.store.record import canonical

LONGEST_NAME = 100  # file systems stop at 255 bytes, people long before


def readable(name: str) -> str:
    """`name` as part of a file name: letters, digits, '.', '_', '=', '+' and single '-'; at most 100 characters."""
    text = re.sub(r"-{2,}", "-", re.sub(r"[^A-Za-z0-9._=+-]+", "-", name)).strip("-.")
    return text[:LONGEST_NAME].rstrip("-.") or "case"


def key_hash(key: str) -> str:
    """The first 8 hex digits of SHA-256 of the canonical JSON of a case. Raises StudyError when it is no JSON."""
    return hashlib.sha256(canonical(key).encode()).hexdigest()[:8]


def study_folder(root: Path, study: str) -> Path:
    """The folder of `study` below `root`. Raises StudyError for a name that would lead elsewhere."""
    if readable(study) != study:
        raise StudyError(f"{study!r} cannot name a study: use letters, digits, '_' and '-'")
    return Path(root) / study


def record_path(root: Path, study: str, name: str, key: str) -> Path:
    """Where the record of the case `key` (JSON text), called `name`, lies."""
    return study_folder(root, study) / f"{readable(name)}-{key_hash(key)}.h5"


def timing_path(path: Path, machine: str) -> Path:
    """The file with the frame times that `machine` (its id) measured for the case recorded in `path`."""
    if readable(machine) != machine or "." in machine:
        raise StudyError(f"{machine!r} cannot be a machine id: use the id of studies.store.machine")
    return path.with_name(f"{path.stem}.timing.{machine}.h5")


def index_path(root: Path, study: str) -> Path:
    """The file with links to all records of `study`."""
    return study_folder(root, study) / f"{study}.h5"


def record_files(root: Path, study: str) -> list[Path]:
    """The records of `study`, sorted; no timing files, no index, no unfinished files."""
    index = index_path(root, study)
    return [p for p in sorted(index.parent.glob("*.h5")) if p != index and ".timing." not in p.name]


def timing_files(root: Path, study: str) -> list[Path]:
    """The timing files of `study`, of all machines, sorted."""
    return sorted(study_folder(root, study).glob("*.timing.*.h5"))
