"""A number of a case in two results folders, and what its change means given its uncertainty."""

import math
import re
from collections import defaultdict
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from studies.metrics.metrics import METRICS
from studies.metrics.table import DISTURBED
from studies.scene.quantities import ALWAYS
from studies.store.record import Record

ROUND_OFF = 1e-5
"""Relative difference below which numbers are equal: tables have six digits."""
SMALLEST = 1e-6
"""Difference below which numbers of a table are equal, in their unit: of a volume kept to 1e-8 nothing is left."""


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
    Verdict.SAME_BITS: "the numbers are equal to the last bit, in both records too",
    Verdict.ROUND_OFF: f"equal to a relative {ROUND_OFF:g}, which is what a table shows",
    Verdict.WITHIN_FLOOR: "the change is within the uncertainty of the reference, or within the spread of the timing",
    Verdict.MOVED: "the change is larger than that uncertainty, or the number is no longer there",
    Verdict.NOT_RESOLVABLE: "the number has no stated uncertainty, or the first folder lacks it",
    Verdict.OTHER_MACHINE: "a time from another machine; it is not compared",
    Verdict.OTHER_REFERENCE: "an error against another reference, or another published set; it is not compared",
}


def verdict_of(old: float, new: float, floor: float, same_bits: bool) -> Verdict:
    """The verdict on a number that was `old` and is `new`. floor: its uncertainty, NaN if none is stated; same_bits:
    whether the records from which it was computed are equal."""
    if (old == old) > (new == new):
        return Verdict.MOVED
    if old != old:
        return Verdict.NOT_RESOLVABLE
    if old != new and not (math.isfinite(old) and math.isfinite(new)):
        return Verdict.MOVED
    if old == new or abs(new - old) <= ROUND_OFF * max(abs(old), abs(new)):
        return Verdict.SAME_BITS if same_bits and old == new else Verdict.ROUND_OFF
    if floor != floor:
        return Verdict.NOT_RESOLVABLE
    return Verdict.WITHIN_FLOOR if abs(new - old) <= floor else Verdict.MOVED


Row = dict[Hashable, Any]
METRIC = re.compile(r"^(?P<name>\w+) \[(?P<unit>[^\]]+)\]$")
STATUS = "status"
ROW = ("scene", "body", "method", "nodes", "law", "dt/dt_c", "recipe")
"""Columns of a table that identify the case of a row."""
MORE: tuple[tuple[str, ...], ...] = ((), ("law",), ("step",), ("law", "step"), ("recipe",))
"""Further columns in the name of a case, besides body, nodes and method, in the order in which they are tried."""
TIMES = tuple(metric.name for metric in METRICS if metric.unit in ("ms", "µs", "s/s"))
SPEEDS = tuple(metric.name for metric in METRICS if metric.unit == "s/s")
"""TIMES: metrics that depend on the machine; SPEEDS: those of them that are speeds."""
JUDGED = {metric.name: metric.quantity for metric in METRICS if metric.quantity not in (None, *ALWAYS)}
"""Metrics that compare with the reference. Any other number is computed by the run alone, and is known to round-off."""
JUDGE = {
    "contact_force": "force_error",
    "held_force": "force_error",
    "snapshots": "surface_error",
    "surface": "surface_error",
    "pressure": "pressure_error",
}
"""Fields of a run -> the metric whose uncertainty they have where the scene has a reference."""
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


def row_changes(case: Named, old: Row, new: Row, same_bits: bool = False) -> Iterator[Change]:
    """Changes of the status of a case and of all metrics of the old row; one that the new row lacks has moved."""
    if old.get(STATUS) != new.get(STATUS):
        yield Change(case, STATUS, "", str(old.get(STATUS)), str(new.get(STATUS)), np.nan, Verdict.MOVED)
    for column in old:
        named = METRIC.match(str(column))
        if named is None or named["name"] == "dt":
            continue
        name, before, after = named["name"], float(old[column]), float(new.get(column, np.nan))
        if math.isnan(before) and math.isnan(after):
            continue
        floor = max(floor_of(old, name, named["unit"]), floor_of(new, name, named["unit"]))
        if name not in JUDGED and name not in TIMES:
            floor = SMALLEST
        if name in TIMES and any(pd.notna(why := row.get(DISTURBED)) and why for row in (old, new)):
            floor = np.nan
        verdict = verdict_of(before, after, floor, same_bits)
        if name in TIMES and verdict == Verdict.MOVED and np.isnan(after):
            verdict = Verdict.NOT_RESOLVABLE  # that it was not timed moves nothing
        if name in JUDGED and str(old.get(REFERENCE)) != str(new.get(REFERENCE)):
            verdict = Verdict.OTHER_REFERENCE
        yield Change(case, name, named["unit"], before, after, floor, verdict)


def floor_of(row: Row, name: str, unit: str = "%") -> float:
    return float(row.get(f"{name} floor [{unit}]", np.nan))


def record_changes(case: Named, old: Record, new: Record, rows: Sequence[Row] = ()) -> Iterator[Change]:
    """Changes of what two records of a case hold: its status, and of each number and array where it moved most. rows:
    of the case in tables, with the uncertainty of its reference; without, all is known to round-off."""
    if old.status != new.status:
        if not any(rows):
            yield Change(case, STATUS, "", str(old.status), str(new.status), np.nan, Verdict.MOVED)
        return
    units = {name: item.unit for record in (old, new) for name, item in record.fields.items()}
    mine, theirs = _numbers_in(old), _numbers_in(new)
    for name in mine | theirs:
        one, other, unit = mine.get(name, NOTHING), theirs.get(name, NOTHING), units.get(name, "")
        if one.shape != other.shape:
            before, after = ("none" if x is NOTHING else f"{x.shape}" for x in (one, other))
            verdict = Verdict.NOT_RESOLVABLE if one is NOTHING else Verdict.MOVED
            yield Change(case, name, unit, before, after, np.nan, verdict)
        elif one.size:
            start = mine.get("rest") if name == "snapshots" else one[0] if name == "surface" else None
            known = max((floor_of(row, JUDGE[name]) for row in rows if name in JUDGE), default=np.nan) / 100
            floor = np.fmax(known * _largest(one if start is None else one - start), ROUND_OFF * _largest(one))
            alike = (one == other) | (np.isnan(one) & np.isnan(other))
            change = np.where(alike, 0.0, np.abs(np.subtract(other, one, where=~alike, out=np.zeros_like(one))))
            at = np.unravel_index(np.argmax(np.where(np.isnan(change), np.inf, change)), change.shape)
            before, after = float(one[at]), float(other[at])
            same = np.array_equal(one, other, equal_nan=True)
            verdict = Verdict.SAME_BITS if same else verdict_of(before, after, floor, False)
            yield Change(case, name, unit, before, after, float(floor), verdict)


NOTHING = np.empty(0)


def _numbers_in(record: Record) -> dict[str, np.ndarray]:
    """Fields and attributes that are numbers, but for wall times."""
    values = record.attributes | {name: item.values for name, item in record.fields.items()}
    arrays = {name: np.asarray(value) for name, value in values.items() if "seconds" not in name and value is not None}
    return {name: array.astype(float) for name, array in arrays.items() if array.dtype.kind in "biuf"}


def _largest(values: np.ndarray) -> float:
    """Of the sizes of finite values."""
    return float(np.fmax.reduce(np.abs(values), axis=None, initial=0.0, where=np.isfinite(values)))


def labels_of(cases: Iterable[Named]) -> dict[Named, str]:
    """A label of each case: body, nodes and method, and as many further columns as distinguish the cases of a study and
    scene."""
    alike = defaultdict[tuple[str, ...], set[Named]](set)
    for case in cases:
        alike[case.study, case.scene, _case_label(case, ())].add(case)
    labels = dict[Named, str]()
    for group in alike.values():
        more = next((one for one in MORE if len({_case_label(case, one) for case in group}) == len(group)), MORE[-1])
        labels |= {case: _case_label(case, more) for case in group}
    return labels


def _case_label(case: Named, more: tuple[str, ...]) -> str:
    words = {"law": case.law, "step": f"step {case.step}", "recipe": case.recipe}
    return ", ".join(filter(None, [case.body, case.nodes, case.method, *(words[name] for name in more)]))
