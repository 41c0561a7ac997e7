"""What the index of a folder knows of one of its files."""

import json
import os
from pathlib import Path
from typing import Any, NamedTuple

from studies.base.atomic import is_there
from studies.base.errors import DamagedFile, OtherVersion, StudyError
from studies.store.paths import SUFFIX, TIMING, file_stem, key_digest
from studies.store.record import glance
from studies.store.staleness import DAMAGED, OTHER_VERSION

KNOWN = ("seconds", "warnings", "unknowns", "steps_done", "scene", "portable")
"""Attributes that an entry holds beside the head of the record."""


class Entry(NamedTuple):
    """A results file in short."""

    file: str
    """Name in its folder."""
    size: int
    """Bytes."""
    fault: str
    """Why it is of no use to any case (studies.store.staleness); empty for a file that can be read."""
    told: str
    """The sentence of whoever tries to read it; empty likewise. From here on, nothing is known of such a file."""
    digest: str = ""
    """SHA-256 (hex) of its case."""
    at_home: bool = False
    """Whether the name of the file is the one that its case gives it."""
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
    portable: str | None = None
    """Settings of a result that is equal on every x86-64 processor; None for one that is not."""

    def error(self) -> StudyError:
        """Of whoever tries to read a file with a fault."""
        kinds = {DAMAGED: DamagedFile, OTHER_VERSION: OtherVersion}
        return kinds.get(self.fault, StudyError)(self.told)


def state_of(found: os.stat_result) -> str:
    """What tells a file from any earlier one of its name: whoever writes it changes one of these."""
    return f"{found.st_size} {found.st_mtime_ns} {found.st_ctime_ns} {found.st_ino}"


def written(state: str | None) -> str:
    """Size and time of a file, which a copy of the folder has too; of none, nothing."""
    return "" if state is None else " ".join(state.split()[:2])


def read_entry(path: Path) -> Entry:
    """Of a file, held to its checksums. What is wrong with it is part of the entry; raises StudyError only for a folder
    that may not be entered."""
    size = path.stat().st_size if is_there(path) else 0
    try:
        record = glance(path, KNOWN)
        digest = key_digest(record.key)
    except DamagedFile as error:
        return Entry(path.name, size, DAMAGED, str(error))
    except OtherVersion as error:
        return Entry(path.name, size, OTHER_VERSION, str(error))
    except StudyError as error:
        return Entry(path.name, size, str(error), str(error))
    head = (record.kind, record.name, str(record.status), record.message, record.fingerprint, record.machine)
    known: dict[str, Any] = {name: record.attributes.get(name) for name in KNOWN}
    known["warnings"] = known["warnings"] or ""
    at_home = path.name.split(TIMING)[0].removesuffix(SUFFIX) == file_stem(record.name, digest)
    return Entry(path.name, size, "", "", digest, at_home, *head, **known)


def text_of(entry: Entry) -> str:
    """JSON; a number that is none has no place there and is left out."""
    return json.dumps([None if value != value else value for value in entry])


def entry_of(text: str) -> Entry:
    """The entry that was written so."""
    return Entry(*json.loads(text))
