"""Jobs that could not be done: stored as failed, with the cause, so that the rest of a study goes on."""

from dataclasses import dataclass, field

from studies.sweep.job import Job


@dataclass
class Failures:
    """What failed in a sweep because its process died or its file cannot be written, with the cause."""

    causes: dict[str, str] = field(default_factory=dict)
    """Label of a job -> why."""

    def add(self, job: Job, cause: str) -> None:
        """Notes a job and stores it as failed. Raises StudyError when it cannot be stored."""
        self.causes[job.label] = cause
        job.store_failure(cause)

    def can_store(self, job: Job) -> bool:
        """Whether the file of a job can be written; notes a folder in its place as the cause of a failure."""
        path = job.path
        if path.is_dir():
            self.causes[job.label] = f"{path} is a folder where a file belongs: delete it"
        return not path.is_dir()

    def sentence(self, again: str) -> str:
        """All of them in one sentence; again: the command that tries them once more."""
        (label, cause), *others = self.causes.items()
        more = f", and {len(others)} more" if others else ""
        return f"failed: {label} ({cause}){more}; all others are done, `{again}` retries"
