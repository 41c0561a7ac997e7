"""The tables of two results folders, row by row, metric by metric, and what a change means given its uncertainty."""

import re
from collections import defaultdict
from collections.abc import Hashable, Iterable
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from studies.base.errors import StudyError
from studies.metrics.metrics import METRICS
from studies.runs.case import case_from_json
from studies.runs.recipe_text import recipe_text
from studies.scene.quantities import ALWAYS
from studies.store.machine import machine_of
from studies.store.paths import record_files
from studies.store.record import Record, read_record

ROUND_OFF = 1e-5
"""Relative difference below which numbers are equal: tables have six digits."""


class Verdict(StrEnum):
    """Relation of a number in one folder to that in the other."""

    SAME_BITS = "same bits"
    ROUND_OFF = "round-off"
    WITHIN_FLOOR = "within floor"
    MOVED = "moved"
    NOT_RESOLVABLE = "not resolvable"
    OTHER_MACHINE = "other machine"
    OTHER_REFERENCE = "other reference"


MEANING: dict[Verdict, str] = {
    Verdict.SAME_BITS: "the records of both folders are equal to the last bit, and so are the numbers",
    Verdict.ROUND_OFF: f"equal to a relative {ROUND_OFF:g}, which is what a table shows",
    Verdict.WITHIN_FLOOR: "the change is within the uncertainty of the reference, or within the spread of the timing",
    Verdict.MOVED: "the change is larger than that uncertainty",
    Verdict.NOT_RESOLVABLE: "the number has no stated uncertainty, or one folder lacks it",
    Verdict.OTHER_MACHINE: "a time from another machine; it is not compared",
    Verdict.OTHER_REFERENCE: "an error against another reference, or another published set; it is not compared",
}


def verdict_of(old: float, new: float, floor: float, same_bits: bool) -> Verdict:
    """The verdict on a number that was `old` and is `new`. floor: its uncertainty, NaN if none is stated; same_bits:
    whether the records from which it was computed are equal."""
    change = abs(new - old)
    if change != change:
        return Verdict.NOT_RESOLVABLE
    if change <= ROUND_OFF * max(abs(old), abs(new)):
        return Verdict.SAME_BITS if same_bits and change == 0.0 else Verdict.ROUND_OFF
    if floor != floor:
        return Verdict.NOT_RESOLVABLE
    return Verdict.WITHIN_FLOOR if change <= floor else Verdict.MOVED


Key = tuple[str, str]
"""Scene and recipe."""
Row = dict[Hashable, Any]
METRIC = re.compile(r"^(?P<name>\w+) \[(?P<unit>[^\]]+)\]$")
STATUS = "status"
ROW = ("scene", "body", "method", "nodes", "law", "dt/dt_c", "recipe")
"""Columns of a table that identify the case of a row."""
MORE: tuple[tuple[str, ...], ...] = ((), ("law",), ("step",), ("law", "step"), ("recipe",))
"""Further columns in the name of a case, besides body, nodes and method, in the order in which they are tried."""
TIMES = tuple(metric.name for metric in METRICS if metric.spread is not None)
SPEEDS = tuple(metric.name for metric in METRICS if metric.spread is not None and metric.better == "higher")
"""TIMES: metrics that depend on the machine; SPEEDS: those of them that are speeds."""
JUDGED = tuple(metric.name for metric in METRICS if metric.quantity not in (None, *ALWAYS))
"""Metrics that compare with the reference."""
REFERENCE = "reference"
"""Column that names the reference; older tables, without published sets of references, lack it."""


class Named(NamedTuple):
    """A case as tables name it."""

    study: str
    scene: str
    body: str
    method: str
    nodes: str
    law: str
    step: str
    """Time step over the stability limit."""
    recipe: str


@dataclass(frozen=True)
class Change:
    """A number of a case in both folders."""

    case: Named
    metric: str
    unit: str
    old: float | str
    new: float | str
    floor: float
    """Its uncertainty, the larger of both, in its unit; NaN if none is stated."""
    verdict: Verdict

    @property
    def is_time(self) -> bool:
        """Whether the number is a computing time, or a speed: it depends on the machine."""
        return self.metric in TIMES


@dataclass(frozen=True)
class Comparison:
    """All changes of the cases in both folders, and the number of other rows."""

    changes: list[Change]
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
        return pd.DataFrame([change.case._asdict() | _numbers(change) for change in self.changes])

    def counts(self, times: bool) -> dict[Verdict, int]:
        """The count of each verdict among times (`times`), or among other numbers, in the order of Verdict."""
        verdicts = [change.verdict for change in self.changes if change.is_time == times]
        return {verdict: verdicts.count(verdict) for verdict in Verdict}


def _numbers(change: Change) -> dict[str, object]:
    return {field.name: getattr(change, field.name) for field in fields(change) if field.name != "case"}


def compare(old: Path, new: Path) -> Comparison:
    """Every metric of every case that both folders have in the table of a study.

    Raises StudyError for a missing folder, a folder without a table, a table without the columns that identify its
    rows, and two folders without a common case.
    """
    mine, theirs = tables_of(old), tables_of(new)
    changes, only_old, only_new = list[Change](), 0, 0
    machines = machine_of(old), machine_of(new)
    for study in sorted(set(mine) & set(theirs)):
        before, after = mine[study], theirs[study]
        common = [key for key in before if key in after]
        only_old, only_new = only_old + len(before) - len(common), only_new + len(after) - len(common)
        same = equal_records(old, new, study)
        new_changes = [one for key in common for one in changes_of(study, before[key], after[key], key in same)]
        pair = {machine_of(old, study), machine_of(new, study)}
        if None in pair or len(pair) > 1:
            new_changes = [replace(one, verdict=Verdict.OTHER_MACHINE) if one.is_time else one for one in new_changes]
        changes += new_changes
    if not changes:
        raise StudyError(f"{old} and {new} have no case in common; compare folders in which the same study has run")
    return Comparison(changes, only_old, only_new, machines)


def tables_of(folder: Path) -> dict[str, dict[Key, Row]]:
    """Name of a study -> its rows by scene and recipe. Raises StudyError as `compare`."""
    if not folder.is_dir():
        raise StudyError(f"there is no folder {folder}")
    files = {path.parent.name: path for path in sorted(folder.glob("*/*.csv")) if path.stem == path.parent.name}
    tables = {study: rows for study, path in files.items() if (rows := _read(path))}
    if not tables:
        raise StudyError(
            f"{folder} holds no table of a study whose rows name their recipe; `organbench report --results {folder}` "
            "writes it from the runs"
        )
    return tables


def _read(path: Path) -> dict[Key, Row]:
    try:
        table = pd.read_csv(path)
    except (ValueError, OSError) as error:
        again = "write it again with `organbench report`"
        raise StudyError(f"{path} cannot be read as a table ({str(error).strip()}); {again}") from error
    if not {"scene", "recipe"} <= set(table.columns):
        return {}
    return {(str(row["scene"]), str(row["recipe"])): row for row in table.to_dict("records")}


def changes_of(study: str, old: Row, new: Row, same_bits: bool) -> list[Change]:
    """Changes of the status of each case and of all its metrics that one of the folders has."""
    case = Named(study, *(_text(new.get(name, "")) for name in ROW))
    changes = []
    if old.get(STATUS) != new.get(STATUS):
        before, after = str(old.get(STATUS)), str(new.get(STATUS))
        changes.append(Change(case, STATUS, "", before, after, np.nan, Verdict.MOVED))
    for column in [column for column in old if column in new]:
        named = METRIC.match(str(column))
        before, after = old[column], new[column]
        if named is None or named["name"] == "dt" or (pd.isna(before) and pd.isna(after)):
            continue
        name, unit = named["name"], named["unit"]
        floor = max(_floor(old, name, unit), _floor(new, name, unit))
        verdict = verdict_of(float(before), float(after), floor, same_bits)
        if name in JUDGED and str(old.get(REFERENCE)) != str(new.get(REFERENCE)):
            verdict = Verdict.OTHER_REFERENCE
        changes.append(Change(case, name, unit, float(before), float(after), floor, verdict))
    return changes


def _text(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _floor(row: Row, name: str, unit: str) -> float:
    return float(row.get(f"{name} floor [{unit}]", np.nan))


def equal_records(old: Path, new: Path, study: str) -> set[Key]:
    """(scene, recipe) of the cases whose records both folders hold, with equal fields. Records that cannot be read, or
    whose scene no longer exists, count as different."""
    mine, theirs = ({path.name: path for path in record_files(folder, study)} for folder in (old, new))
    pairs = set()
    for name in sorted(set(mine) & set(theirs)):
        try:
            records = read_record(mine[name]), read_record(theirs[name])
            case = case_from_json(records[0].key)
        except StudyError:
            continue
        if _equal(*records):
            pairs.add((case.scene.name, recipe_text(case)))
    return pairs


def _equal(one: Record, other: Record) -> bool:
    return set(one.fields) == set(other.fields) and all(
        np.array_equal(field.values, other.fields[name].values, equal_nan=field.values.dtype.kind == "f")
        for name, field in one.fields.items()
    )


def labels_of(cases: Iterable[Named]) -> dict[Named, str]:
    """A label of each case: body, nodes and method, and as many further columns as distinguish the cases of a study and
    scene."""
    alike = defaultdict[tuple[str, ...], set[Named]](set)
    for case in cases:
        alike[case.study, case.scene, _case_label(case, ())].add(case)
    labels = dict[Named, str]()
    for group in alike.values():
        more = next(one for one in MORE if len({_case_label(case, one) for case in group}) == len(group))
        labels |= {case: _case_label(case, more) for case in group}
    return labels


def _case_label(case: Named, more: tuple[str, ...]) -> str:
    words = {"law": case.law, "step": f"step {case.step}", "recipe": case.recipe}
    return ", ".join(filter(None, [case.body, case.nodes, case.method, *(words[name] for name in more)]))
