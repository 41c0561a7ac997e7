"""What a results folder holds of the pieces of studies, by the indexes of its folders: files are opened only once."""

from collections.abc import Callable
from pathlib import Path

from studies.reference.checkpoints import kept
from studies.reference.reference_solves import STUDY as REFERENCES
from studies.reference.reference_solves import ReferenceSolve, SolveStanding, reference_fingerprint
from studies.runs.case import Case
from studies.runs.current import case_fingerprint
from studies.runs.digest import case_digest
from studies.store.index.entry import Entry
from studies.store.index.folder import FolderIndex
from studies.store.machine import machine_id
from studies.store.paths import DIGITS, SUFFIX, file_stem, key_digest, timing_name
from studies.store.schema import Status
from studies.store.staleness import CASE_CHANGED, CODE_CHANGED, MISSING
from studies.sweep.tasks import Task

FAILURES = (Status.FAILED, Status.NOT_CONVERGED, Status.TIMED_OUT)
"""Of a piece that another run may bring further."""
TIMED = (Status.OK, Status.INVERTED, Status.DRIFTED)
"""A run that broke off has no comparable frames."""


class Known:
    """The stored results below `root`, as they are when each folder is first asked for.

    check: whether every file is held to its checksums again, and not only those that have changed.
    """

    def __init__(self, root: Path, check: bool = False) -> None:
        self.root, self.check = Path(root), check
        self._folders: dict[str, FolderIndex] = {}
        self._codes: dict[tuple[type, str], str] = {}

    def folder(self, study: str) -> FolderIndex:
        """Of a study, or REFERENCES."""
        if study not in self._folders:
            self._folders[study] = FolderIndex(self.root, study, self.check)
        return self._folders[study]

    def of_case(self, study: str, case: Case) -> Entry | None:
        """The file of a case, whatever is in it; None where there is none."""
        digest = case_digest(case)
        found = self.folder(study).records.get(digest[:DIGITS], [])
        if len(found) == 1 and found[0].at_home and found[0].digest == digest:
            return found[0]
        name = file_stem(case.name, digest) + SUFFIX
        return next((entry for entry in found if entry.file == name), None)

    def code(self, case: Case) -> str:
        """Of what makes the run of a case (studies.runs.current.case_fingerprint): all that its method and its law
        come from."""
        made_by = type(case.method), case.body.law
        if made_by not in self._codes:
            self._codes[made_by] = case_fingerprint(case)
        return self._codes[made_by]

    def of_solve(self, solve: ReferenceSolve) -> Entry | None:
        """The file of a piece of a reference."""
        return self.folder(REFERENCES).entries.get(solve.path(self.root).name)

    def entry(self, task: Task) -> Entry | None:
        """The file of a piece."""
        work = task.work
        return self.of_solve(work) if isinstance(work, ReferenceSolve) else self.of_case(task.study, work)

    def why_stale(self, task: Task) -> str | None:
        """Why a piece must run (again) (studies.store.staleness); None when it need not."""
        return self.look(task)[1]

    def is_portable(self, task: Task) -> bool:
        """Whether the stored result of a piece is one that is equal on every x86-64 processor."""
        entry = self.entry(task)
        return entry is not None and entry.portable is not None

    def look(self, task: Task) -> tuple[Entry | None, str | None]:
        """The file of a piece, and why it must run."""
        entry, work = self.entry(task), task.work
        if isinstance(work, ReferenceSolve):
            return entry, _why(entry, lambda: key_digest(work.key), reference_fingerprint())
        return entry, _why(entry, lambda: case_digest(work), self.code(work))

    def why_case_is_stale(self, study: str, case: Case) -> str | None:
        """The same of a case."""
        return _why(self.of_case(study, case), lambda: case_digest(case), self.code(case))

    def why_solve_is_stale(self, solve: ReferenceSolve) -> str | None:
        """The same of a piece of a reference."""
        return _why(self.of_solve(solve), lambda: key_digest(solve.key), reference_fingerprint())

    def of_timing(self, study: str, case: Case) -> Entry | None:
        """The file with this machine's frame times of a case."""
        entry = self.of_case(study, case)
        return entry and self.folder(study).entries.get(timing_name(entry.file, machine_id()))

    def can_be_timed(self, study: str, case: Case) -> bool:
        """Whether the case ran to its end."""
        entry = self.of_case(study, case)
        return entry is not None and entry.status in TIMED

    def why_untimed(self, study: str, case: Case) -> str | None:
        """Why this machine must time a case (again), were it to be timed; None when it need not."""
        return _why(self.of_timing(study, case), lambda: case_digest(case), self.code(case))

    def standing(self, solve: ReferenceSolve) -> SolveStanding:
        """How a piece of a reference stands: read off the folder, or off the load path half-way to it."""
        begun = kept(solve.path(self.root), solve.stamp)
        if begun is not None:
            done = len([e for e in begun.path if e.t in solve.scene.checkpoints])
            return SolveStanding(solve, "half-way", None, done, float("nan"))
        entry, why = self.of_solve(solve), self.why_solve_is_stale(solve)
        if entry is None or entry.fault:
            return SolveStanding(solve, "missing" if entry is None else "unreadable", None, 0, float("nan"))
        seconds = float("nan") if entry.seconds is None else entry.seconds
        state = entry.status if why is None else "stale"
        return SolveStanding(solve, state, entry.unknowns, entry.steps_done or 0, seconds)


def _why(entry: Entry | None, digest: Callable[[], str], fingerprint: str) -> str | None:
    if entry is None:
        return MISSING
    if entry.fault:
        return entry.fault
    if entry.digest != digest():
        return CASE_CHANGED
    return None if entry.fingerprint == fingerprint else CODE_CHANGED
