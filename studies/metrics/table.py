"""Tables with one row per case: its settings, its status, and the metrics of the study with the uncertainty of their
reference."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from massspring.methods.capabilities import No
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.metrics.cells import (
    DISTURBED_MARK,
    DISTURBED_NOTE,
    FEW_MARK,
    FEW_NOTE,
    MISSED_NOTE,
    UNCONVERGED_MARK,
    UNCONVERGED_NOTE,
    UNRESOLVED_NOTE,
    UNTESTED_MARK,
    UNTESTED_NOTE,
)
from studies.metrics.contact import few_facets
from studies.metrics.interval import WITHIN, untested
from studies.metrics.metric import Metric
from studies.metrics.metrics import METRICS
from studies.metrics.run import Run
from studies.metrics.wish import missed
from studies.reference.uncertainty import QUANTITIES
from studies.runs.recipe_text import recipe_text
from studies.scene.scene import Scene

Row = dict[str, Any]
"""Column name -> value."""
OFF_SHAPE = "reference off shape [%]"
"""Column with the distance of the reference's finest mesh from the true shape, over the size."""
UNCONVERGED = "not converged"
"""Column with the reason why the answer of the method depends on the step and on the order of elements."""
UNRESOLVED = "doubtful"
"""Column with the metrics whose value is less than ten times the uncertainty of the reference."""
MISSES = "misses"
"""Column with the metrics that miss the default target of the scene, or a bound of the shape."""
FEW_FACETS = "few facets"
"""Column that says whether a sphere or capsule touches fewer than eight facets."""
UNTESTED = "untested"
"""Column that says under which load of the scene the rule of its intervals was not tested."""
DISTURBED, PROCESSOR = "disturbed", "processor"
"""Columns of a table with times: why these are not those of the program alone, and the processor that they are of."""
MARKS = {UNCONVERGED: UNCONVERGED_MARK, FEW_FACETS: FEW_MARK, UNTESTED: UNTESTED_MARK, DISTURBED: DISTURBED_MARK}
NOTES = {MISSES: MISSED_NOTE, UNRESOLVED: UNRESOLVED_NOTE, FEW_FACETS: FEW_NOTE, UNCONVERGED: UNCONVERGED_NOTE}
NOTES |= {UNTESTED: UNTESTED_NOTE, DISTURBED: DISTURBED_NOTE}
"""Columns -> the mark of a row with something there, and what a table says of it."""


def metric(name: str | Metric) -> Metric:
    """The metric called `name`, or `name` itself if it is a user's metric.

    Raises StudyError with the nearest match; also for a user's metric whose name is taken, or whose quantity no
    reference has.
    """
    if isinstance(name, str):
        return lookup(name, {m.name: m for m in METRICS}, "metric")
    if name not in METRICS and name.name in [m.name for m in METRICS]:
        raise StudyError(f"metric '{name.name}' is one of the project's own; give yours another name")
    if name.quantity is not None:
        lookup(name.quantity, QUANTITIES, f"quantity of a reference in metric '{name.name}':")
    return name


def check_columns(names: Sequence[str | Metric]) -> None:
    """Raises StudyError for a name that is no metric, before minutes are spent on a table without it."""
    for name in names:
        metric(name)


def study_table(runs: Sequence[Run], columns: Sequence[str | Metric]) -> pd.DataFrame:
    """A table of the metrics `columns`, names or metrics, for `runs`; a column "… floor" follows a metric with an
    uncertainty."""
    metrics = [metric(name) for name in columns]
    return frame_of([row_of(run, metrics) for run in runs])


def frame_of(rows: Sequence[Row]) -> pd.DataFrame:
    """Rows as a table, without empty "… floor" columns, and with FEW_FACETS, DISTURBED and PROCESSOR only if one row
    has something there."""
    frame = pd.DataFrame(rows)
    seldom = [name for name in (FEW_FACETS, DISTURBED, PROCESSOR) if not any(row.get(name) for row in rows)]
    frame = frame.drop(columns=seldom, errors="ignore")
    unknown = [name for name in frame.columns if " floor [" in name and frame[name].isna().to_numpy().all()]
    return frame.drop(columns=unknown)


def marked(row: Mapping[Any, Any]) -> str:
    """The method of a row with its MARKS."""
    return " ".join([row["method"], *(mark for key, mark in MARKS.items() if row.get(key))])


def row_of(run: Run, metrics: Sequence[Metric]) -> Row:
    """Settings, status and metrics of a run, with uncertainties."""
    case, attributes = run.case, run.record.attributes
    converged = case.method.capabilities.converged
    row: Row = {
        "scene": case.scene.name,
        "body": case.body.series,
        "law": attributes.get("law", ""),
        "nodes": case.body.nodes,
        "stiffness": case.body.stiffness,
        "method": case.method_words,
        "dt [ms]": 1e3 * attributes["dt"] if "dt" in attributes else float("nan"),
        "dt/dt_c": attributes["dt"] / attributes["dt_limit"] if "dt" in attributes else float("nan"),
        "status": str(run.record.status),
        "recipe": recipe_text(case),
        "reference": "" if run.reference is None else run.reference.source,
        UNCONVERGED: converged.because if isinstance(converged, No) else "",
        OFF_SHAPE: float("nan") if run.reference is None else 100.0 * run.reference.shape_error,
    }
    for entry in metrics:
        row[f"{entry.name} [{entry.unit}]"] = entry(run)
        row[f"{entry.name} floor [{entry.unit}]"] = entry.uncertainty(run)
    row[FEW_FACETS] = few_facets(run)
    within = [row[f"{entry.name} [{entry.unit}]"] for entry in metrics if entry.name in WITHIN]
    row[UNTESTED] = untested(case.scene) if any(value == value for value in within) else ""
    timing = run.timing if any(entry.spread is not None for entry in metrics) else None
    row[DISTURBED], row[PROCESSOR] = ("", "") if timing is None else (timing.disturbed, timing.processor)
    row[UNRESOLVED] = " ".join(entry.name for entry in metrics if entry.unresolved(run))
    return row | misses(case.scene, row)


def misses(scene: Scene, row: Mapping[str, Any]) -> Row:
    """The column MISSES of a row."""
    values = {name.removesuffix(" [%]"): value for name, value in row.items() if name.endswith(" [%]")}
    return {MISSES: " ".join(missed(scene, values))}
