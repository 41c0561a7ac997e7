"""Whether a stored result is that of a case by this code, and still what was written."""

from pathlib import Path

from studies.base.atomic import is_there
from studies.base.errors import DamagedFile, OtherVersion, StudyError
from studies.store.record import canonical, peek

MISSING = "has not run"
DAMAGED = "its file is damaged"
OTHER_VERSION = "its file was written by another version, in another layout"
CASE_CHANGED = "the case has changed since"
CODE_CHANGED = "the code has changed since"


def why_stale(path: Path, key: str, fingerprint: str) -> str | None:
    """Why a case must run (again): one of the sentences above, or that the file may not be read; None when it need
    not. The whole file is held to its checksums, every time: a disk that loses bits does not change a date.

    Raises StudyError when the folder may not be entered.
    """
    if not is_there(path):
        return MISSING
    try:
        record = peek(path)
        if canonical(record.key) != canonical(key):
            return CASE_CHANGED
    except DamagedFile:
        return DAMAGED
    except OtherVersion:
        return OTHER_VERSION
    except StudyError as problem:
        return str(problem)
    return None if record.fingerprint == fingerprint else CODE_CHANGED


def is_current(path: Path, key: str, fingerprint: str) -> bool:
    """Whether `path` holds the result of this very case by this very code (ok or failed alike)."""
    return why_stale(path, key, fingerprint) is None
