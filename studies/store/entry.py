"""A results file in short, and whether it is the result of a case by this code: the one answer to "is it current"."""

import os
from pathlib import Path
from typing import Any, NamedTuple

from studies.base.atomic import is_there
from studies.base.errors import DamagedFile, OtherVersion, StudyError
from studies.store.paths import key_digest
from studies.store.record import glance

MISSING = "has not run"
DAMAGED = "its file is damaged"
OTHER_VERSION = "its file was written by another version, in another layout"
CASE_CHANGED = "the case has changed since"
CODE_CHANGED = "the code has changed since"
HEAD = ("kind", "name", "status", "message", "fingerprint", "machine")
ATTRIBUTES = ("seconds", "warnings", "unknowns", "steps_done", "scene")
"""Of a record, what an entry holds."""


class Entry(NamedTuple):
    """A results file in short: a line of the ledger (studies.store.ledger)."""

    file: str
    """Name in its folder."""
    size: int
    """Bytes."""
    mtime: int
    ctime: int
    """Times of the last change of content, and of the file itself [ns since 1970]."""
    inode: int
    fault: str = ""
    """Why it is of no use to any case: DAMAGED, OTHER_VERSION, or that it may not be read; empty for a good file."""
    error_message: str = ""
    """The sentence for whoever tries to read it; empty likewise. All that follows is empty for a file with a fault."""
    digest: str = ""
    """SHA-256 (hex) of its case."""
    kind: str = ""
    name: str = ""
    status: str = ""
    message: str = ""
    fingerprint: str = ""
    machine: str = ""
    seconds: float | None = None
    warnings: str = ""
    unknowns: int | None = None
    steps_done: int | None = None
    scene: str | None = None
    """Of a reference: the name of its scene."""

    @property
    def state(self) -> tuple[int, ...]:
        """Size, times and inode: whoever writes the file changes one of these."""
        return self[1:5]

    @property
    def written(self) -> str:
        """Name, size and time, which a copy of the folder has too."""
        return f"{self.file} {self.size} {self.mtime}"

    def error(self) -> StudyError:
        """What reading a file with a fault raises."""
        kinds = {DAMAGED: DamagedFile, OTHER_VERSION: OtherVersion}
        return kinds.get(self.fault, StudyError)(self.error_message)


def file_state(status: os.stat_result) -> tuple[int, int, int, int]:
    """Entry.state of a file."""
    return status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino


def read_entry(path: Path) -> Entry:
    """The entry of a file, whose checksums are verified. What is wrong with the file is part of the entry.

    Raises StudyError only for a folder that may not be entered.
    """
    state = file_state(path.stat()) if is_there(path) else (0, 0, 0, 0)
    empty = Entry(path.name, *state)
    try:
        record = glance(path, ATTRIBUTES)
        digest = key_digest(record.key)
    except DamagedFile as error:
        return empty._replace(fault=DAMAGED, error_message=str(error))
    except OtherVersion as error:
        return empty._replace(fault=OTHER_VERSION, error_message=str(error))
    except StudyError as error:
        return empty._replace(fault=str(error), error_message=str(error))
    values: dict[str, Any] = {name: record.attributes.get(name) for name in ATTRIBUTES}
    values = {name: None if value != value else value for name, value in values.items()}  # SQLite has no NaN
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


def why_stale(path: Path, key: str, fingerprint: str) -> str | None:
    """The same for a single file, which is read; `key`: the case as JSON text."""
    return why_entry_is_stale(read_entry(path) if is_there(path) else None, key_digest(key), fingerprint)
