"""The stored runs of a study, beside their references and frame times."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

from studies.base.atomic import is_there
from studies.base.errors import OtherVersion, StudyError
from studies.catalog.study import Study
from studies.metrics.run import Run
from studies.reference.load import load_reference
from studies.runs.case import Case
from studies.runs.current import case_path
from studies.store.archived import is_archive
from studies.store.record import read_record
from studies.timing.cases import read_timing

T = TypeVar("T")


def load_runs(root: Path, study: Study) -> tuple[list[Run], list[str]]:
    """The stored runs of a study with references and timings, and what is missing or damaged, a sentence each."""
    problems: list[StudyError] = []

    def tried(load: Callable[[], T]) -> T | None:
        try:
            return load()
        except StudyError as error:
            problems.append(error)
            return None

    references = {scene.name: tried(partial(load_reference, root, scene)) for scene in study.scenes}
    runs = []
    for case in study.cases:
        path = case_path(root, study.name, case)
        if not is_there(path):
            problems.append(not_stored(root, case))
            continue
        record = tried(partial(read_record, path))
        if record is not None:
            timing = tried(partial(read_timing, root, study.name, case)) if case.timed else None
            runs.append(Run(case, record, references[case.scene.name], timing))
    return runs, remarks_of(problems)


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
