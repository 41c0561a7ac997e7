"""Where the record of a case lies, and whether it is there from this code."""

from pathlib import Path

from studies.runs.case import Case
from studies.store.fingerprint import source_fingerprint
from studies.store.paths import record_path
from studies.store.record import is_current


def run_fingerprint() -> str:
    """Hash of all code that a run depends on; the scene itself is part of the case."""
    return source_fingerprint("massspring", "studies.geometry", "studies.runs.prepare", "studies.runs.run")


def case_path(root: Path, study: str, case: Case) -> Path:
    """Where the record of a case lies."""
    return record_path(root, study, case.name, case.key)


def case_is_current(root: Path, study: str, case: Case) -> bool:
    """Whether it is there, from this code."""
    return is_current(case_path(root, study, case), case.key, run_fingerprint())
