"""What two results folders hold, case by case and number by number, and what a change means given its uncertainty.

Records speak for themselves; a table speaks only for a folder without any, as results/published.
"""

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype

from studies.base.errors import StudyError
from studies.metrics.change import (
    METRIC,
    REFERENCE,
    ROW,
    SPEEDS,
    STATUS,
    TIMES,
    Change,
    Named,
    Row,
    Verdict,
    record_changes,
    row_changes,
)
from studies.metrics.metrics import METRICS
from studies.metrics.run import Run
from studies.metrics.table import row_of
from studies.metrics.timing.cases import timing_of
from studies.reference.load import Reference, reference_for
from studies.runs.case import Case, case_from_json
from studies.runs.recipe_text import recipe_text
from studies.scene.as_json import scene_to_json
from studies.scene.scene import Scene
from studies.store.machine import machine_id, machine_of
from studies.store.paths import SUFFIX, TIMING, index_path, record_files, timing_name
from studies.store.record import Record, read_record

Key = tuple[str, str]
"""Scene and recipe of a case."""
NUMBER = " number "
"""Between a recipe and its number, where several rows of a scene have it."""
NAMED = 3
"""Names in a sentence."""
AGAIN = "write it again with `organbench report`"


@dataclass(frozen=True)
class Comparison:
    """All changes of the cases in both folders, the number of other cases, and what is missing or damaged."""

    changes: list[Change]
    findings: list[str]
    """A sentence for each file that cannot be read, and for what a folder should hold and lacks."""
    only_old: int
    only_new: int

    machines: tuple[str | None, str | None]
    """Ids of the machines that measured the old and the new times; None if a folder does not record it."""

    @property
    def same_machine(self) -> bool:
        """Whether times can be compared: both folders record the same machine."""
        old, new = self.machines
        return old is not None and old == new

    @property
    def moved(self) -> list[Change]:
        moved = [change for change in self.changes if change.verdict == Verdict.MOVED]
        return sorted(moved, key=lambda change: change.is_time)

    @property
    def time_ratio(self) -> float:
        """Median of new over old computing times [1]; NaN if both folders have none in common."""
        pairs = [(c.old, c.new) if c.metric not in SPEEDS else (c.new, c.old) for c in self.changes if c.is_time]
        ratios = [new / old for old, new in pairs if old > 0 and new > 0]  # type: ignore[operator]
        return float(np.median(ratios)) if ratios else float("nan")

    def table(self) -> pd.DataFrame:
        names = [field.name for field in fields(Change) if field.name != "case"]
        return pd.DataFrame([one.case._asdict() | {name: getattr(one, name) for name in names} for one in self.changes])

    def counts(self, times: bool) -> dict[Verdict, int]:
        """The count of each verdict among times (`times`), or among other numbers, in the order of Verdict."""
        verdicts = [change.verdict for change in self.changes if change.is_time == times]
        return {verdict: verdicts.count(verdict) for verdict in Verdict}


class Stored(NamedTuple):
    """A record in a folder."""

    file: str
    record: Record
    case: Case | None
    """None for a record of another kind than a run, and for a method of a user's file."""

    @property
    def key(self) -> Key:
        return (self.case.scene.name, recipe_text(self.case)) if self.case else ("", self.file)


class Shelf:
    """What a results folder holds of one study, and what is wrong with it, a sentence each."""

    def __init__(self, root: Path, study: str) -> None:
        self.study, self.root, self.folder = study, root, root / study
        self.files = {path.name: path for path in record_files(root, study)}
        self.timings = {path.name: path for path in sorted(self.folder.glob(f"*{TIMING}*{SUFFIX}"))}
        self.has_records = bool(self.files) or index_path(root, study).exists()
        self.machine = machine_of(root, study)
        self.findings = dict[str, None]()
        self._references: dict[str, Reference | None] = {}

    @cached_property
    def table(self) -> dict[Key, Row]:
        """Rows of its table, empty without one that names recipes. One that cannot be read is a finding, without
        records a StudyError."""
        path = self.folder / f"{self.study}.csv"
        try:
            table = pd.read_csv(path) if path.is_file() else pd.DataFrame()
        except (ValueError, OSError) as error:
            problem = f"{path} cannot be read as a table ({str(error).strip()}); {AGAIN}"
            if not self.has_records:
                raise StudyError(problem) from error
            self.findings[problem], table = None, pd.DataFrame()
        if not {"scene", "recipe"} <= set(table.columns):
            return {}
        for name in [name for name in (*ROW, STATUS, REFERENCE) if name in table.columns]:
            table[name] = table[name].astype(object).fillna("")
        texts = [column for column in table if METRIC.match(str(column)) and not is_numeric_dtype(table[column])]
        if texts:
            raise StudyError(f"{path} has a text among the numbers of its column '{texts[0]}'; {AGAIN}")
        return _by_key(((str(row["scene"]), str(row["recipe"])), row) for row in table.to_dict("records"))

    @property
    def size(self) -> int:
        """The number of its cases; no record is opened."""
        return len(self.files if self.has_records else self.table)

    @cached_property
    def metrics(self) -> set[str]:
        """Names of those in its table; of all without one."""
        columns = (METRIC.match(str(column)) for row in self.table.values() for column in row)
        return {match["name"] for match in columns if match} or {metric.name for metric in METRICS}

    def read(self, file: str) -> Stored | None:
        """A record; None and a finding where it cannot be read."""
        record = self._record(self.files[file])
        if record is None:
            return None
        try:
            return Stored(file, record, case_from_json(record.key))
        except StudyError:
            return Stored(file, record, None)

    def _record(self, path: Path | None) -> Record | None:
        try:
            return None if path is None else read_record(path)
        except StudyError as error:
            self.findings[str(error)] = None
            return None

    @cached_property
    def rows(self) -> dict[Key, Row]:
        """Rows of all its cases: of its records, or of its table where it has none."""
        if not self.has_records:
            return self.table
        stored = [one for file in self.files if (one := self.read(file))]
        rows = _by_key((one.key, self.row(one, self.metrics)) for one in stored)
        self.check_table(stored, rows)
        return rows

    def row(self, stored: Stored, names: Collection[str]) -> Row:
        """The row of a run in a table of the metrics `names`; empty without a case."""
        if stored.case is None:
            return {}
        times = self._record(self.timings.get(timing_name(stored.file, self.machine or machine_id())))
        timing = None if times is None else timing_of(times)
        run = Run(stored.case, stored.record, self._reference(stored.case.scene), timing)
        return {**row_of(run, [metric for metric in METRICS if metric.name in names])}

    def _reference(self, scene: Scene) -> Reference | None:
        """None where it cannot be read: its file has a finding of its own, if it is there."""
        key = scene_to_json(scene)
        if key not in self._references:
            try:
                self._references[key] = reference_for(self.root, scene)
            except StudyError:
                self._references[key] = None
        return self._references[key]

    def check_table(self, stored: Collection[Stored], rows: dict[Key, Row]) -> None:
        """A finding for rows of its table without a record, and for numbers in it that are not those of `rows`."""
        keys = {one.key for one in stored}
        bare = [f"{scene} {recipe}" for scene, recipe in self.table if (scene, recipe.split(NUMBER)[0]) not in keys]
        if bare and len(stored) == len(self.files) and all(one.case for one in stored):
            self.find(f"has {len(bare)} rows in its table without a record", bare)
        pairs = [(self.table[key], row) for key, row in rows.items() if key in self.table and row]
        changes = [one for pair in pairs for one in row_changes(_named(self.study, pair[1]), *pair)]
        old = [one for one in changes if not one.is_time and one.verdict in (Verdict.MOVED, Verdict.WITHIN_FLOOR)]
        if old:
            self.find(f"has a table that is not of its records; {AGAIN}", [one.metric for one in old])

    def find(self, what: str, names: Iterable[str]) -> None:
        names = list(dict.fromkeys(names))
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        self.findings[f"{self.folder} {what}: {', '.join(names[:NAMED])}{more}"] = None


def compare(old: Path | str, new: Path | str) -> Comparison:
    """Every number of every case that both folders have.

    Raises StudyError for a missing folder, a folder without results, a table that cannot be read, and two folders
    without a common case.
    """
    old, new = Path(old), Path(new)
    mine, theirs = _shelves(old), _shelves(new)
    changes, findings, only_old, only_new = list[Change](), list[str](), 0, 0
    tables = not any(shelf.has_records for shelf in (*mine.values(), *theirs.values()))
    for study in sorted(set(mine) & set(theirs)):
        one, other = mine[study], theirs[study]
        recorded = one.has_records and other.has_records
        found = _by_record(one, other) if recorded else _by_row(one, other)
        lacking = [" ".join(key) for key in one.rows if key not in other.rows] if tables else []
        if lacking:
            other.find(f"lacks {len(lacking)} rows that {one.folder} has", lacking)
        if one.has_records and not other.has_records:
            other.findings[f"{other.folder} holds a table alone, {one.folder} holds records"] = None
        if None in (one.machine, other.machine) or one.machine != other.machine:
            found = [replace(each, verdict=Verdict.OTHER_MACHINE) if each.is_time else each for each in found]
        keys = [set(shelf.files if recorded else shelf.rows) for shelf in (one, other)]
        only_old, only_new = only_old + len(keys[0] - keys[1]), only_new + len(keys[1] - keys[0])
        changes, findings = changes + found, [*findings, *one.findings, *other.findings]
    lost = [study for study, shelf in mine.items() if study not in theirs and (tables or shelf.has_records)]
    findings += [f"{new / study} holds no results, {old / study} does" for study in lost]
    only_old += sum(shelf.size for study, shelf in mine.items() if study not in theirs)
    only_new += sum(shelf.size for study, shelf in theirs.items() if study not in mine)
    if not changes and (tables or not findings):
        raise StudyError(f"{old} and {new} have no case in common; compare folders in which the same study has run")
    return Comparison(changes, findings, only_old, only_new, (machine_of(old), machine_of(new)))


def _shelves(folder: Path) -> dict[str, Shelf]:
    if not folder.is_dir():
        raise StudyError(f"there is no folder {folder}")
    found = {path.name: Shelf(folder, path.name) for path in sorted(folder.iterdir()) if path.is_dir()}
    held = {study: shelf for study, shelf in found.items() if shelf.has_records or shelf.table}
    if not held:
        raise StudyError(
            f"{folder} holds no record, and no table of a study whose rows name their recipe; `organbench run STUDY "
            f"--results {folder}` makes both"
        )
    return held


def _by_row(old: Shelf, new: Shelf) -> list[Change]:
    pairs = [(row, new.rows[key]) for key, row in old.rows.items() if key in new.rows]
    return [one for row, other in pairs for one in row_changes(_named(old.study, other), row, other)]


def _by_record(old: Shelf, new: Shelf) -> list[Change]:
    """Also finds what the new folder lacks. Of equal records the tables are compared too, without their times."""
    lost = [file for file in old.files if file not in new.files]
    lost += [file for file in old.timings if file not in new.timings and old.machine == new.machine]
    if lost:
        new.find(f"lacks {len(lost)} records that {old.folder} has", lost)
    changes, shelves = list[Change](), (old, new)
    before, after = ({file: one for file in shelf.files if (one := shelf.read(file))} for shelf in shelves)
    moved: tuple[dict[Key, Row], dict[Key, Row]] = ({}, {})
    for file in [file for file in before if file in after]:
        one, other = before[file], after[file]
        same = all(bit.verdict == Verdict.SAME_BITS for bit in record_changes(NOBODY, one.record, other.record))
        names = TIMES if same else old.metrics | new.metrics
        row, new_row = old.row(one, names), new.row(other, names)
        case = _named(old.study, new_row) if new_row else NOBODY._replace(study=old.study, body=other.record.name)
        changes += [*row_changes(case, row, new_row), *record_changes(case, one.record, other.record, (row, new_row))]
        if not same:
            moved[0][one.key], moved[1][other.key] = row, new_row
    alike = [key for key in old.table if key in new.table and (key[0], key[1].split(NUMBER)[0]) not in moved[1]]
    for key in alike:
        of_tables = row_changes(_named(old.study, new.table[key]), old.table[key], new.table[key], same_bits=True)
        changes += [change for change in of_tables if not change.is_time]
    old.check_table(before.values(), moved[0])
    new.check_table(after.values(), moved[1])
    return changes


NOBODY = Named(*[""] * len(Named._fields))


def _named(study: str, row: Row) -> Named:
    return Named(study, *(f"{x:.3g}" if isinstance(x, float) else str(x) for x in (row.get(name, "") for name in ROW)))


def _by_key(rows: Iterable[tuple[Key, Row]]) -> dict[Key, Row]:
    """Rows by their keys; those of the same key, as of two scenes of one name, are numbered."""
    rows = list(rows)
    count, met = Counter(key for key, _ in rows), Counter[Key]()
    keyed = {}
    for (scene, recipe), row in rows:
        met[scene, recipe] += 1
        number = f"{NUMBER}{met[scene, recipe]}" if count[scene, recipe] > 1 else ""
        keyed[scene, recipe + number] = row
    return keyed
