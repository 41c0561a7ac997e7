"""Where the record of a case lies, and whether it is there from this code."""

import hashlib
from pathlib import Path

from massspring.sources import source_fingerprint
from studies.geometry.mesher.jobs import MAKERS
from studies.runs.case import Case
from studies.runs.user_code import files_of
from studies.store.paths import record_path
from studies.store.staleness import why_stale


def run_fingerprint() -> str:
    """Hash of the code that makes a run and of all that it imports; the scene itself is part of the case."""
    return source_fingerprint("studies.runs.run", *MAKERS)


def case_fingerprint(case: Case) -> str:
    """Hash of the code that makes the run of a case: that, and the user's files in which its method and law are."""
    own = files_of(case.method, case.body.law)
    if not own:
        return run_fingerprint()
    return hashlib.sha256("\0".join([run_fingerprint(), *(file.fingerprint for file in own)]).encode()).hexdigest()


def case_path(root: Path, study: str, case: Case) -> Path:
    """Where the record of a case lies."""
    return record_path(root, study, case.name, case.key)


def why_case_is_stale(root: Path, study: str, case: Case) -> str | None:
    """Why it must run (again) (studies.store.staleness); None when it need not."""
    return why_stale(case_path(root, study, case), case.key, case_fingerprint(case))
