"""Tables with one row per case: its settings, its status, and the metrics of the study with the uncertainty of their
reference."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from massspring.methods.capabilities import No
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.metrics.cells import FEW_MARK, UNCONVERGED_MARK
from studies.metrics.metric import Metric
from studies.metrics.metrics import METRICS, few_facets
from studies.metrics.run import Run
from studies.reference.uncertainty import QUANTITIES
from studies.runs.recipe_text import recipe_text

Row = dict[str, Any]
"""Column name -> value."""
OFF_SHAPE = "reference off shape [%]"
"""Column with the distance of the reference's finest mesh from the true shape, over the size."""
UNCONVERGED = "not converged"
"""Column with the reason why the answer of the method depends on the step and on the order of elements."""
UNRESOLVED = "doubtful"
"""Column with the metrics whose value is less than ten times the uncertainty of the reference."""
FEW_FACETS = "few facets"
"""Column that says whether a sphere or capsule touches fewer than eight facets."""


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
    """Rows as a table, without empty "… floor" columns, and with FEW_FACETS only if it is true of one."""
    frame = pd.DataFrame(rows)
    if FEW_FACETS in frame and not any(row[FEW_FACETS] for row in rows):
        frame = frame.drop(columns=FEW_FACETS)
    unknown = [name for name in frame.columns if " floor [" in name and frame[name].isna().to_numpy().all()]
    return frame.drop(columns=unknown)


def marked(row: Mapping[Any, Any]) -> str:
    """The method of a row, with UNCONVERGED_MARK if it is not converged, and FEW_MARK if it touches few facets."""
    marks = [mark for key, mark in ((UNCONVERGED, UNCONVERGED_MARK), (FEW_FACETS, FEW_MARK)) if row.get(key)]
    return " ".join([row["method"], *marks])


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
    row[UNRESOLVED] = " ".join(entry.name for entry in metrics if entry.unresolved(run))
    return row
