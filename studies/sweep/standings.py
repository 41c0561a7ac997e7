"""How every job of a study stands, by the ledger of what is stored."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from studies.base.counting import amounts, status_counts
from studies.catalog.study import Study
from studies.runs.recipe_text import body_words
from studies.runs.recipes import ADAPTIVE
from studies.store.entry import MISSING, Entry
from studies.store.ledger import FAILURES, Ledger
from studies.store.schema import Status
from studies.sweep.job import CaseJob, Job, case_jobs, jobs_of, reference_jobs

PERCENTAGE = re.compile(r"(\d+(?:\.\d+)?) %")
CAUSES = 8
"""Of failures that are named one by one."""


@dataclass(frozen=True)
class Standing:
    """How a job stands."""

    job: Job
    status: str
    """A Status, "stale" or "missing"."""
    message: str
    entry: Entry | None = None
    """Its file; None where there is none."""

    @property
    def ended(self) -> bool:
        """Whether a current result is stored."""
        return self.status not in ("stale", "missing")


def standings(ledger: Ledger, study: Study) -> list[Standing]:
    """Every job of a study: ok, failed in some way, stale or missing."""
    return [standing_of(ledger, job) for job in jobs_of(ledger.root, [study])]


def standing_of(ledger: Ledger, job: Job) -> Standing:
    entry, why = ledger.entry(job), ledger.why(job)
    if entry is None or why is not None:
        return Standing(job, "missing" if why == MISSING else "stale", why or MISSING, entry)
    return Standing(job, entry.status, entry.message, entry)


def failed(ledger: Ledger, job: Job) -> bool:
    """Whether the stored result of a job is no success; a damaged file is stale instead."""
    entry = ledger.entry(job)
    return entry is not None and entry.status in FAILURES


def warnings_of(ledger: Ledger, study: Study) -> list[str]:
    """What the references and cases of a study warned of, a line each that begins with the body: references first, then
    bodies by how much is expected of them, adaptive before other quadratic ones; of equals the worst first, by the
    largest percentage."""
    jobs = (*reference_jobs(ledger.root, study.scenes), *case_jobs(ledger.root, study))
    stored = [(job, entry.warnings) for job in jobs if (entry := ledger.entry(job)) is not None and entry.warnings]
    stored.sort(key=lambda pair: (*_expected_less(pair[0]), -max(map(float, PERCENTAGE.findall(pair[1])), default=0.0)))
    return list(dict.fromkeys(f"{_body_of(job)}: {text}" for job, text in stored))


def _expected_less(job: Job) -> tuple[bool, ...]:
    body = job.work.body if isinstance(job, CaseJob) else None
    return (body is not None, body is not None and body.graded != ADAPTIVE, getattr(body, "kind", "") != "quadratic")


def _body_of(job: Job) -> str:
    return body_words(job.work.body) if isinstance(job, CaseJob) else job.kind


def summary(job_standings: Sequence[Standing]) -> str:
    """ "9 cases: 7 ok, 2 failed; 6 reference solutions: 6 ok"."""
    groups = {kind: [s.status for s in job_standings if s.job.kind == kind] for kind in ("case", "reference")}
    parts = [f"{amounts(Counter({kind: len(each)}))}: {status_counts(each)}" for kind, each in groups.items() if each]
    return "; ".join(parts) or "no cases"


def unexpected(study: Study, job_standings: Sequence[Standing]) -> list[Standing]:
    """What ended in a way that the study does not expect."""

    def expected(standing: Standing) -> bool:
        if standing.job.kind == "reference":
            return standing.status == Status.OK or study.counts_losses
        return study.accepts(standing.status)

    odd = [standing for standing in job_standings if standing.ended and not expected(standing)]
    return sorted(odd, key=lambda standing: standing.job.kind)


def causes(job_standings: Sequence[Standing]) -> list[str]:
    """A sentence for each distinct cause, with the first label; messages that differ in numbers alone are one."""
    groups: dict[tuple[str, str], list[Standing]] = {}
    for standing in job_standings:
        kind = "".join(letter for letter in standing.message if letter not in "0123456789.e+-")
        groups.setdefault((standing.status, kind), []).append(standing)
    sentences = []
    for (status, _), each in list(groups.items())[:CAUSES]:
        more = f", and {len(each) - 1} more" if len(each) > 1 else ""
        sentences.append(f"{status.replace('-', ' ')}: {each[0].message} ({each[0].job.label}{more})")
    left = len(groups) - CAUSES
    return [*sentences, f"and {left} more causes; `organbench show` names them"] if left > 0 else sentences


def machines_of(job_standings: Iterable[Standing]) -> Counter[str]:
    """Results of each kind of machine, by its id, the most first; stale and missing ones left out."""
    ended = (standing.entry for standing in job_standings if standing.ended and standing.entry is not None)
    return Counter(dict(Counter(entry.machine for entry in ended).most_common()))


def mixture(counts: Counter[str]) -> str | None:
    """A sentence for results that differ by rounding; None where all are of one kind."""
    if len(counts) < 2:
        return None
    parts = [f"{count} of machine {machine}" for machine, count in counts.items()]
    return f"made on {len(counts)} kinds of processors, whose results differ by rounding: {', '.join(parts)}"
