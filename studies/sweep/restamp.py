"""Results that only a change of the code makes stale, kept where replays of a sample give every bit again.

A sample is evidence, not proof: code that no replay reaches may have changed what it computes.
"""

import random
import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

from studies.catalog.study import Study
from studies.reference.published import fingerprint_of
from studies.reference.reference_solves import STUDY as REFERENCES
from studies.reference.reference_solves import ReferenceSolve, reference_solves
from studies.reference.solve import solve
from studies.runs.current import case_fingerprint, case_path
from studies.runs.run import difference, measure
from studies.store.entry import CODE_CHANGED, why_stale
from studies.store.paths import SUFFIX, TIMING
from studies.store.record import Record, Status, peek, read_record, write_record

AT_RANDOM = 3
"""Replays of a kind beyond the quickest of each variety."""
UNREPEATABLE = (Status.FAILED, Status.NOT_CONVERGED, Status.TIMED_OUT)
"""Another run may bring them further: these are run again."""
MEASURED = ("seconds", "cut_seconds", "restamped")
"""Attributes that are no result of the case."""


@dataclass(frozen=True)
class Outdated:
    """A stored result whose only fault is that the code has changed."""

    study: str
    path: Path
    record: Record
    """Without its fields."""
    fingerprint: str
    """Of the present code."""
    variety: str
    """What it shares with the results that run the same code: the method and the kind of body, say."""
    compute: Callable[[], Record]
    """Computes it again and stores nothing."""

    @property
    def seconds(self) -> float:
        """What it took [s]; 0 where that is not stored."""
        return self.record.attributes.get("seconds") or 0.0

    @property
    def kind(self) -> tuple[str, str, str]:
        """Study, former code, present code: what one sample stands for."""
        return self.study, self.record.fingerprint, self.fingerprint


def outdated(root: Path, studies: Iterable[Study]) -> list[list[Outdated]]:
    """The cases and reference solves of `studies` below `root` that a change of the code alone makes stale, by kind.

    Left out: what failed, did not converge or took too long.
    Raises StudyError for a folder that may not be read.
    """
    stale: dict[Path, Outdated] = {}

    def add(study: str, path: Path, key: str, fingerprint: str, variety: str, compute: Callable[[], Record]) -> None:
        if why_stale(path, key, fingerprint) == CODE_CHANGED and (record := peek(path)).status not in UNREPEATABLE:
            stale[path] = Outdated(study, path, record, fingerprint, variety, compute)

    for study in studies:
        for case in study.cases:
            path, variety = case_path(root, study.name, case), f"{case.method.name} {case.body.kind}"
            add(study.name, path, case.key, case_fingerprint(case), variety, partial(measure, case))
        for each in (each for scene in study.scenes for each in reference_solves(scene)):
            variety = "moves" if each.moves else "rests"
            add(REFERENCES, each.path(root), each.key, fingerprint_of(each.scene), variety, partial(solved_again, each))
    in_order = sorted(stale.values(), key=lambda one: (*one.kind, one.path))
    return [list(members) for _, members in groupby(in_order, key=lambda one: one.kind)]


def solved_again(reference_solve: ReferenceSolve) -> Record:
    """A reference solve computed in a folder of its own, which is removed."""
    with tempfile.TemporaryDirectory() as folder:
        return read_record(solve(Path(folder), reference_solve))


def sample(members: list[Outdated]) -> list[Outdated]:
    """Of one kind: the quickest of each variety, and AT_RANDOM others. The same members give the same sample."""
    by_time = sorted(members, key=lambda one: (one.seconds, one.path.name))
    quickest = list({one.variety: one for one in reversed(by_time)}.values())
    others = [one for one in by_time if one not in quickest]
    return quickest + random.Random("".join(members[0].kind)).sample(others, min(AT_RANDOM, len(others)))


def restamp(members: list[Outdated], replayed: list[Outdated], on_replay: Callable[[str], object]) -> str | None:
    """Replays `replayed`; where each gives every number again, all `members` (of one kind) count as results of the
    present code, and their frame times with them. Returns None then, else the first difference, and changes nothing.

    on_replay: called with the name of each result that came out the same.
    Raises StudyError when a file cannot be read or written; the file is then what it was.
    """
    if not replayed:
        raise ValueError("no result is restamped without a replay")
    for one in replayed:
        stored, new = read_record(one.path), one.compute()
        changed = difference(stored, new) or _odd_attribute(stored.attributes, new.attributes)
        if changed:
            return f"{stored.name}: {changed}"
        on_replay(stored.name)
    for one in members:
        timings = sorted(one.path.parent.glob(f"{one.path.name.removesuffix(SUFFIX)}{TIMING}*{SUFFIX}"))
        for path in (*timings, one.path):  # its own last: where a write fails, a second try finds all of them
            _write_stamp(path, one, len(replayed))
    return None


def _write_stamp(path: Path, one: Outdated, replays: int) -> None:
    record, former = read_record(path), one.record.fingerprint
    if record.fingerprint != former:  # run or timed again meanwhile, or by other code
        return
    stamp = "; ".join(filter(None, [record.attributes.get("restamped"), f"from {former} by {replays} replays"]))
    attributes = {**record.attributes, "restamped": stamp}
    write_record(path, replace(record, fingerprint=one.fingerprint, attributes=attributes))


def _odd_attribute(stored: Mapping[str, Any], new: Mapping[str, Any]) -> str | None:
    """The first attribute that differs, as a sentence. Texts may change their words, but not come or go."""
    for name in sorted({*stored, *new} - {*MEASURED}):
        old, now = stored.get(name), new.get(name)
        both_text = bool(old) and bool(now) and isinstance(old, str) and isinstance(now, str)
        both_nan = old != old and now != now
        if not (old == now or both_text or both_nan):
            return f"'{name}' was {old!r}, now it is {now!r}"
    return None
