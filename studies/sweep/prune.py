"""Stored files that nothing needs any more, by rule. Nothing here removes a current result, a chart or a table."""

import time
from collections.abc import Collection
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from studies.base.atomic import is_there, old_parts
from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.reference.reference_solves import STUDY as REFERENCES
from studies.store.archived import check_no_archive
from studies.store.entry import file_state
from studies.store.ledger import FAILURES, Ledger
from studies.store.paths import SUFFIX, TIMING, study_folder
from studies.sweep.job import Job, case_jobs, reference_jobs

DAY = 86_400.0
"""Seconds."""


class Rule(StrEnum):
    """Why a file may go."""

    STALE = "stale"
    FAILED = "failed"
    SUPERSEDED = "superseded"
    ORPHANS = "orphans"


MEANING = {
    Rule.STALE: "made by other code, in an old format, or damaged; the next run replaces them",
    Rule.FAILED: "failed, timed out or not converged: the next run repeats them",
    Rule.SUPERSEDED: "of cases that the study no longer has",
    Rule.ORPHANS: "unfinished files of ended processes, and frame times without their run",
}


@dataclass(frozen=True)
class Prunable:
    """A file that may go."""

    path: Path
    rule: Rule
    size: int
    """Bytes."""
    modified: float
    """When it was written [s since 1970]."""
    state: tuple[int, ...]
    """Its size, times and inode (studies.store.entry)."""


def prunable(
    ledger: Ledger, studies: Collection[Study], rules: Collection[Rule], older: float = 0.0, references: bool = False
) -> list[Prunable]:
    """What the rules let go of `studies`, of what is older than so many days; `references`: also of the references of
    their scenes. Raises StudyError for an archive."""
    check_no_archive(ledger.root)
    folders = {study.name: _of_study(ledger, study) for study in studies}
    if references:
        folders[REFERENCES] = _of_references(ledger, studies)
    named: dict[Path, Rule] = {}
    for name, files in folders.items():
        folder = study_folder(ledger.root, name)
        named |= {folder / file: rule for file, rule in files.items()}
        named |= {part: Rule.ORPHANS for part in old_parts(folder)}
    candidates = [_prunable(path, rule) for path, rule in sorted(named.items()) if rule in rules]
    return [one for one in candidates if one is not None and time.time() - one.modified >= older * DAY]


def remove(files: Collection[Prunable]) -> list[Prunable]:
    """Removes them; what another command has rewritten meanwhile stays. Those that are gone.

    Raises StudyError where a file cannot be removed."""
    gone = []
    for one in files:
        try:
            if is_there(one.path) and file_state(one.path.lstat()) == one.state:
                one.path.unlink()
                gone.append(one)
        except OSError as problem:
            raise StudyError(
                f"{one.path} cannot be removed ({problem.strerror}); {len(gone)} files before it are"
            ) from problem
    return gone


def _prunable(path: Path, rule: Rule) -> Prunable | None:
    """None where it is gone."""
    try:
        stat = path.lstat()
    except FileNotFoundError:
        return None
    return Prunable(path, rule, stat.st_size, stat.st_mtime, file_state(stat))


def _of_study(ledger: Ledger, study: Study) -> dict[str, Rule]:
    """By the name of a file in the study's folder: the rule that lets it go. Current results are not among them."""
    files, jobs = ledger.files(study.name), {job.path().name: job for job in case_jobs(ledger.root, study)}
    rules: dict[str, Rule] = {}
    for file in (name for name in files if TIMING not in name):
        rule = _rule(ledger, jobs[file]) if file in jobs else Rule.SUPERSEDED
        if rule is not None:
            rules[file] = rule
        elif (timing := ledger.timing(jobs[file])) is not None and ledger.why_untimed(jobs[file]) is not None:
            rules[timing.file] = Rule.STALE
    for timing in (name for name in files if TIMING in name):
        record = timing.split(TIMING)[0] + SUFFIX
        if record not in files:
            rules[timing] = Rule.ORPHANS
        elif record in rules:  # frame times go with their run
            rules[timing] = rules[record]
    return rules


def _of_references(ledger: Ledger, studies: Collection[Study]) -> dict[str, Rule]:
    """The same for the references of the scenes of studies; those of any other scene stay."""
    scenes = {scene.name for study in studies for scene in study.scenes}
    jobs = {job.path().name: job for study in studies for job in reference_jobs(ledger.root, study.scenes)}
    rules: dict[str, Rule] = {}
    for file, entry in ledger.files(REFERENCES).items():
        rule = _rule(ledger, jobs[file]) if file in jobs else None
        if rule is None and file not in jobs and entry.kind == "reference" and entry.scene in scenes:
            rule = Rule.SUPERSEDED
        if rule is not None:
            rules[file] = rule
    return rules


def _rule(ledger: Ledger, job: Job) -> Rule | None:
    if ledger.why(job) is not None:
        return Rule.STALE
    entry = ledger.entry(job)
    return Rule.FAILED if entry is not None and entry.status in FAILURES else None
