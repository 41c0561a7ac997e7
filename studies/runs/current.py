"""The path of the record of a case, and the hash of the code that makes it."""

import hashlib
from pathlib import Path

from massspring.sources import source_fingerprint
from studies.geometry.mesher.jobs import MAKERS
from studies.runs.case import Case
from studies.runs.recipes import ADAPTER, ADAPTIVE
from studies.runs.user_code import files_of
from studies.store.paths import record_path


def run_fingerprint() -> str:
    """Hash of the code that makes a run and of all that it imports; the scene itself is part of the case."""
    return source_fingerprint("studies.runs.run", *MAKERS)


def case_fingerprint(case: Case) -> str:
    """Hash of the code that makes the run of a case: `run_fingerprint`, the user's files with its method and law, and
    for an adaptive body the code that solves references."""
    parts = [file.fingerprint for file in files_of(case)]
    if case.body.graded == ADAPTIVE:
        parts.append(source_fingerprint(ADAPTER))
    if not parts:
        return run_fingerprint()
    return hashlib.sha256("\0".join([run_fingerprint(), *parts]).encode()).hexdigest()


def case_path(root: Path, study: str, case: Case) -> Path:
    return record_path(root, study, case.name, case.key)
