"""The table of a study, of which the ledger keeps each row until what it was computed from changes.

That is the record, this machine's frame times, the reference of the scene, and the code of metrics.
"""

import hashlib
from collections.abc import Sequence

from massspring.sources import source_fingerprint
from studies.base.errors import DamagedFile
from studies.base.own_file import file_of
from studies.catalog.study import Study
from studies.metrics.metric import Metric
from studies.metrics.run import Run
from studies.metrics.table import Row, row_of
from studies.store.archived import shown_machine
from studies.store.paths import timing_name
from studies.store.record import read_record
from studies.sweep.load import References, not_stored, reference_problems, sentences, stored_state
from studies.sweep.tasks import CaseTask, case_tasks
from studies.timing.cases import read_timing


def table_rows(references: References, study: Study, metrics: Sequence[Metric]) -> tuple[list[Row], list[str]]:
    """A row per stored case (studies.metrics.table), and what is missing or damaged in sentences."""
    ledger, problems = references.ledger, reference_problems(references, study)
    machine, timed = shown_machine(ledger.root), set[str]()
    tasks, wanted = dict[str, CaseTask](), dict[str, str]()
    code = source_fingerprint("studies.metrics.table", "studies.reference.load", "studies.timing.cases")
    scenes = {scene.name: f"{code} {stored_state(ledger, [scene])}" for scene in study.scenes}
    for task in case_tasks(ledger.root, study):
        entry = ledger.entry(task)
        timing = ledger.timing(task, machine) if task.work.timed else None
        problems += [] if entry else [not_stored(ledger.root, task.work)]
        problems += [one.error() for one in (entry, timing) if one and one.fault]
        if entry and not entry.fault:
            tasks[entry.file] = task
            if timing and not timing.fault:
                timed.add(entry.file)
            wanted[entry.file] = f"{timing and timing.state} {task.fingerprint} {scenes[task.work.scene.name]}"

    def measure(file: str) -> Row | None:
        task = tasks[file]
        try:
            record = read_record(task.path())
            timing = read_timing(ledger.root, study.name, task.work) if file in timed else None
        except DamagedFile as problem:  # since the ledger read it
            ledger.forget(study.name, [file, timing_name(file, machine)])
            problems.append(problem)
            return None
        return row_of(Run(task.work, record, references.of(task.work.scene), timing), metrics)

    rows = ledger.measured(study.name, f"row {_hash(metrics)}", wanted, measure)
    return list(rows.values()), sentences(problems)


def _hash(metrics: Sequence[Metric]) -> str:
    """Of metrics; those of a user's file are others when the file is edited."""
    files = ((metric, file_of(metric.of)) for metric in metrics)
    words = [f"{metric.name} {metric.unit} {metric.quantity} {file and file.fingerprint}" for metric, file in files]
    return hashlib.sha256("\n".join(words).encode()).hexdigest()
