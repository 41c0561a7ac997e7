"""A results file in short, and whether it is the result of a case by this code: the one answer to "is it current"."""

import os
from pathlib import Path
from typing import Any, NamedTuple

from studies.base.atomic import is_there
from studies.base.errors import DamagedFile, OtherVersion, StudyError
from studies.store.paths import key_digest
from studies.store.record import peek

MISSING = "has not run"
DAMAGED = "its file is damaged"
OTHER_VERSION = "its file was written by another version, in another layout"
CASE_CHANGED = "the case has changed since"
CODE_CHANGED = "the code has changed since"
HEAD = ("name", "status", "message", "fingerprint", "machine")
ATTRIBUTES = ("seconds", "warnings", "unknowns")
"""Of a record, what an entry holds."""


class Entry(NamedTuple):
    """A results file in short."""

    file: str
    """Name in its folder."""
    state: tuple[int, ...]
    """Of `file_state`."""
    fault: str = ""
    """Why it is of no use to any case: DAMAGED, OTHER_VERSION, or that it may not be read; empty for a good file."""
    error_message: str = ""
    """The sentence for whoever tries to read it; empty likewise. All that follows is empty for a file with a fault."""
    digest: str = ""
    """SHA-256 (hex) of its case."""
    name: str = ""
    status: str = ""
    message: str = ""
    fingerprint: str = ""
    machine: str = ""
    seconds: float | None = None
    warnings: str = ""
    unknowns: int | None = None

    @property
    def written(self) -> str:
        """Name, size and time, which a copy of the folder has too."""
        return f"{self.file} {self.state[0]} {self.state[1]}"

    def error(self) -> StudyError:
        """What reading a file with a fault raises."""
        kinds = {DAMAGED: DamagedFile, OTHER_VERSION: OtherVersion}
        return kinds.get(self.fault, StudyError)(self.error_message)


def file_state(status: os.stat_result) -> tuple[int, ...]:
    """Size [bytes], times of the last change of content and of the file itself [ns], inode: whoever writes a file
    changes one of these."""
    return status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino


def read_entry(path: Path) -> Entry:
    """The entry of a file, whose checksum is verified. What is wrong with the file is part of the entry.

    Raises StudyError only for a folder that may not be entered.
    """
    empty = Entry(path.name, file_state(path.stat()) if is_there(path) else (0, 0, 0, 0))
    try:
        record = peek(path, ATTRIBUTES)
        digest = key_digest(record.key)
    except StudyError as error:
        kinds = {DamagedFile: DAMAGED, OtherVersion: OTHER_VERSION}
        return empty._replace(fault=kinds.get(type(error), str(error)), error_message=str(error))
    values: dict[str, Any] = {name: record.attributes.get(name) for name in ATTRIBUTES}
    values = {name: None if value != value else value for name, value in values.items()}  # NaN: not known
    values |= {name: str(getattr(record, name)) for name in HEAD} | {"warnings": values["warnings"] or ""}
    return empty._replace(digest=digest, **values)


def why_entry_is_stale(entry: Entry | None, digest: str, fingerprint: str) -> str | None:
    """Why a case must run (again), given the entry of its file: one of the sentences above, or that the file may not
    be read. None when the file holds the result of this very case by this very code, ok or failed alike.

    digest: SHA-256 of the case (studies.store.paths.key_digest); fingerprint: of the code that computes it.
    """
    if entry is None:
        return MISSING
    if entry.fault:
        return entry.fault
    if entry.digest != digest:
        return CASE_CHANGED
    return None if entry.fingerprint == fingerprint else CODE_CHANGED
