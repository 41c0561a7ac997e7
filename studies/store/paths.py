"""Where things lie below the results folder: results/STUDY/NAME-HASH8.h5, its timing files and the study's index."""

import hashlib
import re
from pathlib import Path

from studies.base.errors import StudyError
from studies.store.record import canonical

DIGITS = 8
"""Of the hash in the name of a file."""
SUFFIX, TIMING = ".h5", ".timing."
"""Of results files; between the name of a record and the machine that timed it."""
LONGEST_NAME = 100  # file systems stop at 255 bytes, people long before


def readable(name: str) -> str:
    """`name` as part of a file name: letters, digits, '.', '_', '=', '+' and single '-'; at most 100 characters."""
    text = re.sub(r"-{2,}", "-", re.sub(r"[^A-Za-z0-9._=+-]+", "-", name)).strip("-.")
    return text[:LONGEST_NAME].rstrip("-.") or "case"


def key_digest(key: str) -> str:
    """SHA-256 (hex) of the canonical JSON of a case. Raises StudyError when it is no JSON."""
    return hashlib.sha256(canonical(key).encode()).hexdigest()


def key_hash(key: str) -> str:
    """Its first 8 digits, which end the name of the file."""
    return key_digest(key)[:DIGITS]


def study_folder(root: Path, study: str) -> Path:
    """The folder of `study` below `root`. Raises StudyError for a name that would lead elsewhere."""
    if readable(study) != study:
        raise StudyError(f"{study!r} cannot name a study or scene: use letters, digits, '_' and '-'")
    return Path(root) / study


def file_stem(name: str, digest: str) -> str:
    """How the file of a case is called, without SUFFIX."""
    return f"{readable(name)}-{digest[:DIGITS]}"


def record_path(root: Path, study: str, name: str, key: str) -> Path:
    """Where the record of the case `key` (JSON text), called `name`, lies."""
    return study_folder(root, study) / f"{file_stem(name, key_digest(key))}{SUFFIX}"


def timing_path(path: Path, machine: str) -> Path:
    """The file with the frame times that `machine` (its id) measured for the case recorded in `path`."""
    if readable(machine) != machine or "." in machine:
        raise StudyError(f"{machine!r} cannot be a machine id: use the id of studies.store.machine")
    return path.with_name(timing_name(path.name, machine))


def timing_name(file: str, machine: str) -> str:
    """Name of the timing file that belongs to the record `file`."""
    return f"{file.removesuffix(SUFFIX)}{TIMING}{machine}{SUFFIX}"


def index_path(root: Path, study: str) -> Path:
    return study_folder(root, study) / f"{study}.h5"


def record_files(root: Path, study: str) -> list[Path]:
    """The records of `study`, sorted; no timing files, no index, no unfinished files."""
    index = index_path(root, study)
    return [p for p in sorted(index.parent.glob("*.h5")) if p != index and ".timing." not in p.name]
