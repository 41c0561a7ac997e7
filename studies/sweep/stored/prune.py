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
from studies.reference.reference_solves import reference_solves
from studies.store.archived import check_no_archive
from studies.store.index.entry import Entry, state_of
from studies.store.paths import SUFFIX, TIMING, study_folder
from studies.sweep.stored.known import FAILURES, Known

DAY = 86_400.0
"""Seconds."""


class Rule(StrEnum):
    """Why a file may go."""

    STALE = "stale"
    FAILED = "failed"
    SUPERSEDED = "superseded"
    ORPHANS = "orphans"


MEANING = {
    Rule.STALE: "of other code, of another layout, or damaged: the next run replaces them",
    Rule.FAILED: "stored as failed, timed out or not converged: the next run tries them again",
    Rule.SUPERSEDED: "of cases that the study has no more",
    Rule.ORPHANS: "unfinished files of processes that are gone, and frame times without their run",
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
    state: str
    """What tells it from any later file of its name."""


def prunable(
    root: Path, studies: Collection[Study], rules: Collection[Rule], older: float = 0.0, references: bool = False
) -> list[Prunable]:
    """What the rules let go of `studies` below `root`, of what is older than so many days; `references`: also of the
    references of their scenes. Raises StudyError for an archive."""
    check_no_archive(root)
    known = Known(root)
    named: dict[Path, Rule] = {}
    for study in studies:
        folder = study_folder(root, study.name)
        named |= {folder / file: rule for file, rule in _of_study(known, study).items()}
        named |= {part: Rule.ORPHANS for part in old_parts(folder)}
    if references:
        folder = study_folder(root, REFERENCES)
        named |= {folder / file: rule for file, rule in _of_references(known, studies).items()}
        named |= {part: Rule.ORPHANS for part in old_parts(folder)}
    found = [_looked_at(path, rule) for path, rule in sorted(named.items()) if rule in rules]
    return [one for one in found if one is not None and time.time() - one.modified >= older * DAY]


def remove(found: Collection[Prunable]) -> list[Prunable]:
    """Removes them; what another command has written anew meanwhile stays. Those that are gone.

    Raises StudyError where a file cannot be removed."""
    gone = []
    for one in found:
        try:
            if is_there(one.path) and state_of(one.path.lstat()) == one.state:
                one.path.unlink()
                gone.append(one)
        except OSError as problem:
            raise StudyError(
                f"{one.path} cannot be removed ({problem.strerror}); {len(gone)} files before it are"
            ) from problem
    return gone


def _looked_at(path: Path, rule: Rule) -> Prunable | None:
    """None where it is gone."""
    try:
        found = path.lstat()
    except FileNotFoundError:
        return None
    return Prunable(path, rule, found.st_size, found.st_mtime, state_of(found))


def _of_study(known: Known, study: Study) -> dict[str, Rule]:
    """By the name of a file in the study's folder: the rule that lets it go. Current results are not among them."""
    folder = known.folder(study.name)
    found: dict[str, Rule] = {}
    used: set[str] = set()
    for case in study.cases:
        entry = known.of_case(study.name, case)
        if entry is None:
            continue
        used.add(entry.file)
        rule = _rule(entry, known.why_case_is_stale(study.name, case))
        if rule is not None:
            found[entry.file] = rule
        timing = known.of_timing(study.name, case)
        if timing is not None and rule is None and known.why_untimed(study.name, case) is not None:
            found[timing.file] = Rule.STALE
    found |= {file: Rule.SUPERSEDED for file in folder.entries if TIMING not in file and file not in used}
    for timing in folder.timings():
        record = timing.file.split(TIMING)[0] + SUFFIX
        if record not in folder.entries:
            found[timing.file] = Rule.ORPHANS
        elif record in found:  # frame times go with their run
            found[timing.file] = found[record]
    return found


def _of_references(known: Known, studies: Collection[Study]) -> dict[str, Rule]:
    """The same for the references of the scenes of studies; those of any other scene stay."""
    scenes = {scene.name: scene for study in studies for scene in study.scenes}
    found: dict[str, Rule] = {}
    solves = {solve.path(known.root).name: solve for scene in scenes.values() for solve in reference_solves(scene)}
    for file, entry in known.folder(REFERENCES).entries.items():
        if file in solves:
            rule = _rule(entry, known.why_solve_is_stale(solves[file]))
            if rule is not None:
                found[file] = rule
        elif entry.kind == "reference" and entry.scene in scenes:
            found[file] = Rule.SUPERSEDED
    return found


def _rule(entry: Entry, why: str | None) -> Rule | None:
    if why is not None:
        return Rule.STALE
    return Rule.FAILED if entry.status in FAILURES else None
