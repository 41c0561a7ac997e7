"""The table of a study, of which the ledger keeps each row until what it was computed from changes.

That is the record, this machine's frame times, the reference of the scene, and the code of metrics.
"""

import hashlib
from collections.abc import Sequence

from massspring.sources import source_fingerprint
from studies.catalog.study import Study
from studies.metrics.metric import Metric
from studies.metrics.table import Row, row_of
from studies.runs.user_code import file_of
from studies.store.archived import shown_machine
from studies.store.paths import timing_name
from studies.sweep.job import CaseJob, case_jobs, reference_jobs
from studies.sweep.load import References, load_run, not_stored, reference_problems, sentences


def table_rows(references: References, study: Study, metrics: Sequence[Metric]) -> tuple[list[Row], list[str]]:
    """A row per stored case (studies.metrics.table), and what is missing or damaged in sentences."""
    ledger, problems = references.ledger, reference_problems(references, study)
    code = source_fingerprint("studies.metrics.table", "studies.sweep.load")
    scenes = {scene.name: ledger.state(reference_jobs(ledger.root, [scene])) for scene in study.scenes}
    jobs, dependencies, machine = dict[str, CaseJob](), dict[str, str](), shown_machine(ledger.root)
    for job in case_jobs(ledger.root, study):
        entry, timing = ledger.entry(job), ledger.timing(job, machine) if job.work.timed else None
        problems += [] if entry else [not_stored(ledger.root, job)]
        problems += [one.error() for one in (entry, timing) if one and one.fault]
        if entry and not entry.fault:
            jobs[entry.file] = job
            texts = timing and timing.state, job.fingerprint, code, scenes[job.work.scene.name]
            dependencies[entry.file] = " ".join(map(str, texts))

    def measure(file: str) -> Row | None:
        run, damaged = load_run(references, jobs[file])
        if damaged:  # since the ledger read it
            ledger.forget(study.name, [file, timing_name(file, machine)])
            problems.extend(damaged)
        return row_of(run, metrics) if run else None

    rows = ledger.measured(study.name, f"row {_hash(metrics)}", dependencies, measure)
    return list(rows.values()), sentences(problems)


def _hash(metrics: Sequence[Metric]) -> str:
    """Of metrics; those of a user's file are others when the file is edited."""
    files = ((metric, file_of(metric.of)) for metric in metrics)
    words = [f"{metric.name} {metric.unit} {metric.quantity} {file and file.fingerprint}" for metric, file in files]
    return hashlib.sha256("\n".join(words).encode()).hexdigest()
