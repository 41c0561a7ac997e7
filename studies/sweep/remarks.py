"""What is said of results that are missing or cannot be read."""

from collections.abc import Sequence
from pathlib import Path

from studies.base.errors import OtherVersion, StudyError
from studies.runs.case import Case
from studies.store.archived import is_archive


def not_stored(root: Path, case: Case) -> StudyError:
    """What is said of a case without a file."""
    what = "is missing in the archive" if is_archive(root) else "has not run"
    return StudyError(f"case {case.name} {what}")


def remarks_of(problems: Sequence[StudyError]) -> list[str]:
    """A sentence each, but one for all files of another version: after an update these are all files."""
    others = [str(problem) for problem in problems if isinstance(problem, OtherVersion)]
    more = f" (and {len(others) - 1} more files)" if len(others) > 1 else ""
    messages = [str(problem) for problem in problems if not isinstance(problem, OtherVersion)]
    return [*messages, others[0] + more] if others else messages
