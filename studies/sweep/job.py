"""The jobs that studies are made of: cases, and the solutions of their references."""

import json
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

from numpy.linalg import LinAlgError

from studies.base.atomic import is_there
from studies.base.doing import doing
from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.reference.published import Entry, fingerprint_of, published, record_of
from studies.reference.reference_solves import STUDY as REFERENCES
from studies.reference.reference_solves import ReferenceSolve, reference_solves
from studies.runs.case import Case
from studies.runs.current import case_fingerprint
from studies.runs.user_code import files_of
from studies.scene.scene import Scene
from studies.store.entry import file_state, read_entry, why_entry_is_stale
from studies.store.paths import SUFFIX, file_stem, key_digest, study_folder
from studies.store.record import Status, new_record, write_record
from studies.sweep.estimate import case_seconds, solve_seconds, unknowns

REFERENCE = "reference "
"""Before the name of a reference solution in its label."""


@dataclass(frozen=True)
class Job(ABC):
    """One job, which can run in any process."""

    root: Path
    """The results folder."""
    study: str
    """Name of the study, or of the folder of references."""
    work: Any
    """A Case or a ReferenceSolve: what it computes."""
    initial_state: tuple[int, ...] | None = field(default=None, compare=False)
    """State of its file when the sweep began; None where there was none."""
    digest: str = field(init=False, compare=False)
    """SHA-256 (hex) of what it computes."""
    path: Path = field(init=False, compare=False)
    """Where its record lies."""

    kind: ClassVar[str]
    """ "case" or "reference"."""

    def __post_init__(self) -> None:
        digest = key_digest(self.work.key)
        file = f"{file_stem(self.work.name, digest)}{SUFFIX}"
        object.__setattr__(self, "digest", digest)
        object.__setattr__(self, "path", study_folder(self.root, self.study) / file)

    @property
    @abstractmethod
    def label(self) -> str:
        """For progress and messages."""

    @property
    @abstractmethod
    def weight(self) -> float:
        """Longest first keeps both cores busy to the end: references by mesh, then cases by size over step."""

    @property
    @abstractmethod
    def seconds(self) -> float:
        """Estimated duration on the machine of results/published [s]."""

    @property
    @abstractmethod
    def fingerprint(self) -> str:
        """Hash of the code that computes it."""

    @abstractmethod
    def run(self) -> Path:
        """Computes it and stores the result; where the record lies. Raises StudyError when it cannot be stored."""

    @abstractmethod
    def failure(self) -> tuple[str, dict[str, Any]]:
        """Kind and attributes of the record of a job that could not be done."""

    def store_failure(self, cause: str) -> Path:
        """Stores it as failed. Raises StudyError when it cannot be stored."""
        kind, attributes = self.failure()
        head = {"kind": kind, "key": self.work.key, "name": self.work.name, "fingerprint": self.fingerprint}
        failed = new_record(**head, status=Status.FAILED, message=cause, attributes=attributes, fields={})
        write_record(self.path, failed)
        return self.path

    @property
    def state(self) -> tuple[int, ...] | None:
        """Size, times and inode of its file now; None where there is none."""
        return file_state(self.path.stat()) if is_there(self.path) else None

    def done_meanwhile(self) -> bool:
        """Whether another command has stored its result since the sweep began."""
        if self.state in (None, self.initial_state):
            return False
        return why_entry_is_stale(read_entry(self.path), self.digest, self.fingerprint) is None


@dataclass(frozen=True)
class CaseJob(Job):
    work: Case
    kind = "case"

    @property
    def label(self) -> str:
        return self.work.name

    @property
    def weight(self) -> float:
        return self.work.body.nodes / self.work.dt_fraction

    @property
    def seconds(self) -> float:
        return case_seconds(self.work)

    @property
    def fingerprint(self) -> str:
        return case_fingerprint(self.work)

    def run(self) -> Path:
        from studies.runs.run import run_case  # with the solver, which takes most of a second to load

        return run_case(self.root, self.study, self.work)

    def failure(self) -> tuple[str, dict[str, Any]]:
        from studies.runs.run import OWN_FILES

        own = {str(file.path): file.sha256 for file in files_of(self.work)}
        return "run", {"warnings": ""} | ({OWN_FILES: json.dumps(own)} if own else {})


@dataclass(frozen=True)
class ReferenceJob(Job):
    """The reference of a scene. A published one is copied, not solved."""

    work: ReferenceSolve
    kind = "reference"

    @cached_property
    def published(self) -> Entry | None:
        return published(self.work.scene)

    @property
    def label(self) -> str:
        return REFERENCE + self.work.name

    @property
    def weight(self) -> float:
        return 1e9 + (0.0 if self.published else unknowns(self.work))

    @property
    def seconds(self) -> float:
        return 0.0 if self.published else solve_seconds(self.work)

    @property
    def fingerprint(self) -> str:
        return fingerprint_of(self.work.scene)

    def run(self) -> Path:
        """A mesh that cannot be made is stored as a failure: it costs its scene, not the sweep."""
        if self.published is not None:
            write_record(self.path, record_of(self.work.scene, self.published))
            return self.path
        from studies.reference.solve import solve

        try:
            return solve(self.root, self.work)
        except StudyError as error:
            return self.store_failure(str(error))
        except LinAlgError as error:  # of a small dense system: NumPy's word for a tangent without an inverse
            return self.store_failure(f"the equations of the reference cannot be solved: {error}")

    def failure(self) -> tuple[str, dict[str, Any]]:
        nothing = {"unknowns": 0, "steps_done": 0, "seconds": float("nan"), "off_shape": 0, "stopped": ""}
        return "reference", {"scene": self.work.scene.name, **nothing}


def do(job: Job) -> Path:
    """Does a job, unless another command has meanwhile; where its record lies."""
    doing(job.label)
    return job.path if job.done_meanwhile() else job.run()


def case_jobs(root: Path, study: Study) -> list[CaseJob]:
    return [CaseJob(root, study.name, case) for case in study.cases]


def reference_jobs(root: Path, scenes: Iterable[Scene]) -> list[ReferenceJob]:
    return [ReferenceJob(root, REFERENCES, one) for scene in scenes for one in reference_solves(scene)]


def jobs_of(root: Path, studies: Iterable[Study]) -> list[Job]:
    """Everything the studies need, each result once: longest first, then what a study wants scene by scene."""
    jobs: dict[Path, Job] = {}
    turns: dict[Path, int] = {}
    for study in sorted(studies, key=lambda study: study.scene_by_scene):
        turn = {scene.name: 1 + at if study.scene_by_scene else 0 for at, scene in enumerate(study.scenes)}
        for job in (*reference_jobs(root, study.scenes), *case_jobs(root, study)):
            jobs.setdefault(job.path, job)
            turns.setdefault(job.path, turn[job.work.scene.name])
    return sorted(jobs.values(), key=lambda job: (turns[job.path], -job.weight))
