"""The table of a study, of which a row is measured once: it is kept with the index until what it was read off changes.

That is the record, this machine's frame times, the reference of the scene, and the code of metrics.
"""

import hashlib
from collections.abc import Sequence

from massspring.sources import source_fingerprint
from studies.base.collection import uncollected
from studies.base.errors import DamagedFile
from studies.catalog.study import Study
from studies.metrics.metric import Metric
from studies.metrics.run import Run
from studies.metrics.table import Row, row_of
from studies.runs.case import Case
from studies.runs.user_code import file_of
from studies.store.archived import shown_machine
from studies.store.index.entry import Entry
from studies.store.index.room import Room
from studies.store.paths import timing_name
from studies.store.record import read_record
from studies.sweep.remarks import not_stored, remarks_of
from studies.sweep.stored.known import Known
from studies.sweep.stored.references import References
from studies.timing.cases import read_timing

ROOM = "rows of "
MOST_ROOMS = 4
"""Sets of metrics whose rows are kept."""


@uncollected()
def table_rows(known: Known, study: Study, metrics: Sequence[Metric]) -> tuple[list[Row], list[str], References]:
    """A row per stored case (studies.metrics.table), what is missing or damaged in sentences, and the references."""
    rows = Rows(known, study, metrics)
    found = [row for case in study.cases if (row := rows.of(case)) is not None]
    rows.keep()
    return found, remarks_of(rows.problems), rows.references


class Rows:
    """The rows of a study for some metrics."""

    def __init__(self, known: Known, study: Study, metrics: Sequence[Metric]) -> None:
        self.known, self.study, self.metrics = known, study, metrics
        self.folder, self.references = known.folder(study.name), References(known)
        self.room, self.machine = Room(self.folder, room_of(metrics)), shown_machine(known.root)
        self.problems = [p for scene in study.scenes if (p := self.references.problem(scene)) is not None]
        code = source_fingerprint("studies.metrics.table", "studies.reference.load", "studies.timing.cases")
        self.scenes = {scene.name: _hash(f"{code} {self.references.state(scene)}") for scene in study.scenes}

    def of(self, case: Case) -> Row | None:
        """Of a case; None where nothing can be read, which is told in `problems`."""
        entry = self.known.of_case(self.study.name, case)
        if entry is None:
            self.problems.append(not_stored(self.known.root, case))
            return None
        if entry.fault:
            self.problems.append(entry.error())
            return None
        timing = self._timing(case, entry)
        try:
            return self.room.get(
                entry.file, self._depends(case, timing), lambda: row_of(self._run(case, entry, timing), self.metrics)
            )
        except DamagedFile as problem:  # since the index read it
            self.folder.forget([entry.file, *([timing.file] if timing else [])])
            self.problems.append(problem)
            return None

    def keep(self) -> None:
        """Keeps what was measured, and forgets some of too many sets of metrics."""
        self.room.keep()
        others = [room for room in self.folder.shelf.rooms() if room.startswith(ROOM) and room != self.room.name]
        self.folder.shelf.drop(others[: max(0, 1 + len(others) - MOST_ROOMS)])

    def _run(self, case: Case, entry: Entry, timing: Entry | None) -> Run:
        record = read_record(self.folder.folder / entry.file)
        measured = read_timing(self.known.root, self.study.name, case) if timing else None
        return Run(case, record, self.references.of(case.scene), measured)

    def _timing(self, case: Case, entry: Entry) -> Entry | None:
        """The frame times that are shown; None also of a damaged file, which is told of."""
        timing = self.folder.entries.get(timing_name(entry.file, self.machine)) if case.timed else None
        if timing is not None and timing.fault:
            self.problems.append(timing.error())
            return None
        return timing

    def _depends(self, case: Case, timing: Entry | None) -> str:
        """What a row depends on beside the record: frame times, code, reference."""
        timed = self.folder.states[timing.file] if timing else "not timed"
        return f"{timed} {self.known.code(case)} {self.scenes[case.scene.name]}"


def room_of(metrics: Sequence[Metric]) -> str:
    """The room for rows of these metrics; those of a user's file are others when the file is edited."""
    own = [file_of(metric.of) for metric in metrics]
    words = [
        f"{m.name} {m.unit} {m.quantity} {file and file.fingerprint}" for m, file in zip(metrics, own, strict=True)
    ]
    return ROOM + _hash("\n".join(words))


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
