"""The jobs that a sweep would run: why, and how long by the seconds of stored results."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from studies.catalog.study import Study
from studies.reference.reference_solves import STUDY as REFERENCES
from studies.store.entry import Entry
from studies.store.ledger import Ledger
from studies.store.machine import machine_id
from studies.sweep.estimate import SECONDS_PER_UNKNOWN, timing_seconds
from studies.sweep.frame_times import timed_again
from studies.sweep.job import REFERENCE, CaseJob, Job, ReferenceJob, case_jobs, jobs_of

PHYSICS, TIMING = "physics", "timing"
"""The stages: the first in several processes, the second alone."""
COPIED = "published "
"""How the fingerprint of a reference begins that was copied (studies.reference.published.fingerprint_of)."""
COPY = "copy"
"""Kind of a published reference, which is copied and not solved."""
AGAIN = "asked for again"
"""Why stored cases are timed though their times are current."""


@dataclass(frozen=True)
class Planned:
    """A piece of work to come."""

    stage: str
    """PHYSICS or TIMING."""
    kind: str
    """ "reference", COPY, "case" or "timing"."""
    label: str
    why: str
    seconds: float | None
    """Duration of its last run [s], without compiling; None where nothing is stored."""
    guess: float = 0.0
    """Seconds by its size and a rate (studies.sweep.estimate), which count where it has not run."""
    here: bool = False
    """Whether that rate is one of this machine."""


def plan(ledger: Ledger, study: Study, selection: Callable[[Job], bool] | None = None) -> list[Planned]:
    """What `run_studies` would run of a study, in its order; `selection` as there."""
    jobs = jobs_of(ledger.root, [study])
    chosen = [job for job in jobs if (ledger.why(job) is not None if selection is None else selection(job))]
    measured = rates(ledger, jobs) if chosen else {}
    pieces = [_of_job(ledger, job, measured) for job in chosen]
    runs = {job.label for job in chosen}
    for job in case_jobs(ledger.root, study):
        if not job.work.timed or (selection is not None and job.label not in runs):
            continue
        why = ledger.why_untimed(job)
        if why is not None and (ledger.can_be_timed(job) or job.label in runs):
            pieces.append(_of_timing(ledger, job, why, measured))
    return pieces


def plan_again(ledger: Ledger, study: Study) -> list[Planned]:
    """What `measure_again` would time of a study, in its order."""
    measured = rates(ledger, jobs_of(ledger.root, [study]))
    return [_of_timing(ledger, job, AGAIN, measured) for job in timed_again(ledger, study)]


def kind_of(stage: str, label: str) -> str:
    """ "reference", "case" or "timing", by the stage and the label of a job."""
    return TIMING if stage == TIMING else "reference" if label.startswith(REFERENCE) else "case"


def rates(ledger: Ledger, jobs: Sequence[Job]) -> dict[str, float]:
    """Measured over estimated seconds of what this machine has stored: of all references by their unknowns, of the
    given cases; a kind of which nothing is stored is left out. A published reference was copied, not solved here."""
    here, sums = machine_id(), {"case": [0.0, 0.0], "reference": [0.0, 0.0]}
    for entry in ledger.files(REFERENCES).values():
        solved_here = entry.machine == here and not entry.fingerprint.startswith(COPIED)
        if entry.seconds and entry.unknowns and solved_here:
            sums["reference"][0] += entry.seconds
            sums["reference"][1] += SECONDS_PER_UNKNOWN * entry.unknowns
    for job in jobs:
        entry = ledger.entry(job)
        if job.kind == "case" and entry and entry.seconds and entry.machine == here:
            sums["case"][0] += entry.seconds
            sums["case"][1] += job.seconds
    return {kind: measured / estimated for kind, (measured, estimated) in sums.items() if measured > 0}


def _of_job(ledger: Ledger, job: Job, measured: Mapping[str, float]) -> Planned:
    why, seconds = ledger.why(job) or "its result failed", _seconds(ledger.entry(job))
    if isinstance(job, ReferenceJob) and job.published:
        return Planned(PHYSICS, COPY, job.label, why, 0.0)  # stored seconds are those of whoever solved it
    guess = 0.0 if seconds is not None else job.seconds * measured.get(job.kind, 1.0)
    return Planned(PHYSICS, job.kind, job.label, why, seconds, guess, job.kind in measured)


def _of_timing(ledger: Ledger, job: CaseJob, why: str, measured: Mapping[str, float]) -> Planned:
    seconds = _seconds(ledger.timing(job))
    guess = 0.0 if seconds is not None else timing_seconds(job.work) * measured.get("case", 1.0)
    return Planned(TIMING, TIMING, job.label, why, seconds, guess, "case" in measured)


def _seconds(entry: Entry | None) -> float | None:
    """That a stored file says; None of one that cannot be read."""
    return None if entry is None or entry.fault else entry.seconds


def expected(pieces: Sequence[Planned], jobs: int) -> float:
    """Seconds that `pieces` take in `jobs` processes, timing alone: what each took, or would by its size; at least as
    long as the longest."""
    seconds = {PHYSICS: [0.0], TIMING: [0.0]}
    for piece in pieces:
        seconds[piece.stage].append(piece.guess if piece.seconds is None else piece.seconds)
    return max(sum(seconds[PHYSICS]) / jobs, *seconds[PHYSICS]) + sum(seconds[TIMING])
