"""What the template of the page shows: charts behind tabs, the table of all cases, the machine. It escapes all text."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from studies.base.counting import heading, readable
from studies.meshing.bounds import REFERENCE_SHAPE
from studies.metrics.cells import MISSING, plain, value_cell
from studies.metrics.metrics import METRICS
from studies.metrics.table import MISSES, OFF_SHAPE, UNRESOLVED, marked
from studies.report.page.svg import inline

ASSETS = Path(__file__).parent / "assets"
Entry = dict[str, Any]
Cell = tuple[str, str | None, str]
"""Class, what the column is sorted by where that is not the text, and text."""
COLUMNS = {
    "force_end": "force",
    "mean_error": "displacement, mean",
    "force_within": "force, 90 of 100 within",
    "mean_within": "displacement, 90 of 100 within",
    "shape_error": "shape / size",
    "shape_volume": "volume of the shape",
    "volume_worst": "worst |V/V0 − 1|",
    "real_time": "simulated / computing",
    "real_time_cpu": "simulated / processor time",
    "interior_error": "interior, rel. L2",
    "silhouette_error": "silhouette / size",
    "min_j": "min J",
    "frame_time": "frame",
    "frame_cpu": "frame, processor",
}
"""Metrics that the page's table shows where they are measured, the most asked for first; the CSV holds them all."""
SIGNED = ("force_end", "shape_volume")
AFTER = {"nodes": "nodes", "dt/dt_c": "step / limit", "law": "law", "status": "status", "study": "study"}
"""Columns behind the metrics, and their heads."""
NUMBERS = ("nodes", "dt/dt_c")
NEAR = "largest share of a target [1]"
"""Column of entries and of the published rows beside them, by which these are in order."""
JUDGED = ("force_end", "mean_error", "real_time")
"""Rows with one of these come before rows without: a stability map has hundreds of those."""


def unbroken(text: str) -> str:
    return text.replace(" ± ", "\u00a0±\u00a0").replace(" %", "\u00a0%").replace(" × ", "\u00a0×\u00a0")


TEMPLATES = Environment(
    loader=FileSystemLoader(ASSETS), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
)
TEMPLATES.filters["unbroken"] = unbroken


def tabs(charts: Mapping[str, Sequence[Mapping[str, str]]], questions: Mapping[str, str]) -> list[Entry]:
    """Each study that has charts (file, svg): its name, heading, question and figures."""
    return [
        {
            "name": name,
            "heading": heading(name),
            "question": questions[name],
            "figures": [_figure(name, chart) for chart in figures],
        }
        for name, figures in charts.items()
        if figures
    ]


def _figure(name: str, chart: Mapping[str, str]) -> Entry:
    words = f"{heading(name)}: {chart['file'].rsplit('.', 1)[0]}"
    svg = inline(chart["svg"], f"{name}-{chart['file'].replace('.', '-')}", words)
    return {"words": words, "svg": Markup(svg)}


def table(rows: Sequence[Mapping[str, Any]], cases: Mapping[str, Any]) -> Entry:
    """Heads and rows (as `study_table`, with "study" and "case") of the table, rows with errors or times first; a row
    whose case is one of `cases` links to it."""
    metrics = {metric.name: metric for metric in METRICS if metric.name in COLUMNS}
    columns = [
        name for name in COLUMNS if name in metrics and any(_value(row, metrics[name]) is not None for row in rows)
    ]
    heads = [("case", "text", "")]
    heads += [(f"{COLUMNS[name]} [{metrics[name].unit}]", "number", metrics[name].description) for name in columns]
    heads += [(words, "number" if name in NUMBERS else "text", "") for name, words in AFTER.items()]
    judged = [metrics[name] for name in JUDGED if name in metrics]
    entries = []
    order = lambda row: (all(_value(row, metric) is None for metric in judged), row.get(NEAR) or 0.0)  # noqa: E731
    for row in sorted(rows, key=order):
        cells = [_metric_cell(row, metrics[name]) for name in columns]
        cells += [_word_cell(row.get(name), name) for name in AFTER]
        entries.append(_names(row, cases) | {"cells": cells})
    return {"heads": heads, "rows": entries}


def _names(row: Mapping[str, Any], cases: Mapping[str, Any]) -> Entry:
    """Scene, body and method; marks: an entry from outside, a reference that is far from the shape, a run that did
    not end well."""
    case = cases.get(row["case"])
    marks = [mark for mark in ("entry", "published") if row.get(mark)]
    off = row.get(OFF_SHAPE)
    marks += [f"reference {off:.2g} % off the shape"] if off is not None and off > REFERENCE_SHAPE else []
    return {
        "case": None if case is None else row["case"],
        "title": None if case is None else case["title"],
        "scene": readable(row["scene"]),
        "marks": [*marks, row["status"]] if row["status"] != "ok" else marks,
        "theirs": bool(row.get("entry")),
        "lines": (f"{row['body']}, {row['nodes']} nodes", marked(row)),
        "order": f"{row['scene']} {row['body']} {row['nodes']} {row['method']}",
    }


def _word_cell(value: Any, name: str) -> Cell:
    if value is None:
        return "", "", MISSING
    if name in NUMBERS:
        return "number", f"{float(value):.6g}", plain(float(value))
    return "words", None, readable(str(value))


def _value(row: Mapping[str, Any], metric: Any) -> float | None:
    return row.get(f"{metric.name} [{metric.unit}]")


def _metric_cell(row: Mapping[str, Any], metric: Any) -> Cell:
    value = _value(row, metric)
    if value is None:
        return "number", "", MISSING
    floor = row.get(f"{metric.name} floor [{metric.unit}]")
    doubtful = metric.name in str(row.get(UNRESOLVED) or "").split()
    # A volume is compared with the rest volume of the body, so the uncertainty of the reference does not apply.
    uncertainty = float("nan") if floor is None or metric.name == "volume_worst" else float(floor)
    misses = metric.name in str(row.get(MISSES) or "").split()
    cell = value_cell(float(value), uncertainty, signed=metric.name in SIGNED, unresolved=doubtful, missed=misses)
    return "number", f"{abs(float(value)):.6g}", cell


def machine_words(machine: Mapping[str, Any]) -> str:
    facts = [str(machine[name]) for name in ("cpu", "system", "python") if machine.get(name)]
    return ", ".join(facts + [f"{name} {version}" for name, version in machine.get("packages", {}).items() if version])


def script_json(data: Any) -> str:
    """JSON that no HTML parser can take for the end of a script."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    for letter in "<>&\u2028\u2029":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return text
