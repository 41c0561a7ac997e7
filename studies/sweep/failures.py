"""Pieces whose process died: stored as failed, with the cause, so that the rest of a study goes on."""

import json
from dataclasses import dataclass, field
from pathlib import Path

from studies.reference.reference_solves import ReferenceSolve, reference_fingerprint
from studies.runs.case import Case
from studies.runs.current import case_fingerprint
from studies.runs.run import OWN_FILES
from studies.runs.user_code import files_of
from studies.store.new_record import new_record
from studies.store.record import Record, Status, write_record
from studies.sweep.tasks import Task


@dataclass
class Failures:
    """What died in a sweep, with its cause."""

    causes: dict[str, str] = field(default_factory=dict)
    """Label of a piece -> why."""

    def add(self, task: Task, cause: str) -> None:
        """Notes a piece and stores it as failed. Raises StudyError when it cannot be stored."""
        self.causes[task.label] = cause
        store_failure(task, cause)

    def can_store(self, task: Task) -> bool:
        """Whether the file of a piece can be written; notes a folder in its place as the cause of a failure."""
        path = task.path()
        if path.is_dir():
            self.causes[task.label] = f"{path} is a folder in the place of its file: delete it"
        return not path.is_dir()

    def sentence(self, again: str) -> str:
        """All of them in one sentence; again: the command that tries them once more."""
        (label, cause), *others = self.causes.items()
        more = f", and {len(others)} more" if others else ""
        return f"failed: {label} ({cause}){more}; the rest is done, `{again}` tries again"


def store_failure(task: Task, cause: str) -> Path:
    """Stores a piece as failed. Raises StudyError when it cannot be stored."""
    path = task.path()
    work = task.work
    write_record(path, _of_reference(work, cause) if isinstance(work, ReferenceSolve) else _of_case(work, cause))
    return path


def _of_case(case: Case, cause: str) -> Record:
    own = {str(file.path): file.sha256 for file in files_of(case.method, case.body.law)}
    return new_record(
        kind="run",
        key=case.key,
        name=case.name,
        status=Status.FAILED,
        message=cause,
        fingerprint=case_fingerprint(case),
        attributes={"warnings": ""} | ({OWN_FILES: json.dumps(own)} if own else {}),
        fields={},
    )


def _of_reference(solve: ReferenceSolve, cause: str) -> Record:
    nothing = {"unknowns": 0, "steps_done": 0, "seconds": float("nan")}
    return new_record(
        kind="reference",
        key=solve.key,
        name=solve.name,
        status=Status.FAILED,
        message=cause,
        fingerprint=reference_fingerprint(),
        attributes={"scene": solve.scene.name, "level": float(solve.level), "variant": solve.variant, **nothing},
        fields={},
    )
