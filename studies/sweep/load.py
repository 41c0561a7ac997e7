"""The stored runs of a study, beside their references and frame times."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

from studies.base.atomic import is_there
from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.metrics.run import Run
from studies.runs.current import case_path
from studies.store.record import read_record
from studies.sweep.remarks import not_stored, remarks_of
from studies.sweep.stored.known import Known
from studies.sweep.stored.references import References
from studies.timing.cases import read_timing

T = TypeVar("T")


def load_runs(root: Path, study: Study, references: References | None = None) -> tuple[list[Run], list[str]]:
    """The stored runs of a study with references (those given, where others need them too) and timings, and what is
    missing or damaged, a sentence each."""
    references = references or References(Known(root))

    def tried(load: Callable[[], T]) -> T | None:
        try:
            return load()
        except StudyError as error:
            problems.append(error)
            return None

    known = {scene.name: references.of(scene) for scene in study.scenes}
    problems = [problem for scene in study.scenes if (problem := references.problem(scene)) is not None]
    runs = []
    for case in study.cases:
        path = case_path(root, study.name, case)
        if not is_there(path):
            problems.append(not_stored(root, case))
            continue
        record = tried(partial(read_record, path))
        if record is not None:
            timing = tried(partial(read_timing, root, study.name, case)) if case.timed else None
            runs.append(Run(case, record, known[case.scene.name], timing))
    return runs, remarks_of(problems)
