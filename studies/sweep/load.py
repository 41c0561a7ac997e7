"""The stored runs of a study, beside their references and frame times."""

from pathlib import Path

from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.metrics.run import Run
from studies.reference.load import Reference, load_reference
from studies.runs.current import case_path
from studies.store.record import read_record
from studies.timing.cases import read_timing


def load_runs(root: Path, study: Study) -> tuple[list[Run], list[str]]:
    """The stored runs of a study with references and timings, and what is missing, a sentence each."""
    references: dict[str, Reference | None] = {}
    remarks: list[str] = []
    for scene in study.scenes:
        try:
            references[scene.name] = load_reference(root, scene)
        except StudyError as error:
            references[scene.name] = None
            remarks.append(str(error))
    runs = []
    for case in study.cases:
        path = case_path(root, study.name, case)
        if not path.exists():
            remarks.append(f"case {case.name} has not run")
            continue
        try:
            timing = read_timing(root, study.name, case) if case.timed else None
            runs.append(Run(case, read_record(path), references[case.scene.name], timing))
        except StudyError as error:
            remarks.append(str(error))
    return runs, remarks
