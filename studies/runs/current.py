"""Where the record of a case lies, and whether it is there from this code."""

from pathlib import Path

from massspring.sources import source_fingerprint
from studies.geometry.mesher.jobs import MAKERS
from studies.runs.case import Case
from studies.store.paths import record_path
from studies.store.staleness import why_stale


def run_fingerprint() -> str:
    """Hash of the code that makes a run and of all that it imports; the scene itself is part of the case."""
    return source_fingerprint("studies.runs.run", *MAKERS)


def case_path(root: Path, study: str, case: Case) -> Path:
    """Where the record of a case lies."""
    return record_path(root, study, case.name, case.key)


def why_case_is_stale(root: Path, study: str, case: Case) -> str | None:
    """Why it must run (again) (studies.store.staleness); None when it need not."""
    return why_stale(case_path(root, study, case), case.key, run_fingerprint())
