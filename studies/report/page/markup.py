"""The parts of the page as HTML: findings, charts behind tabs, the table of all cases, commands. Text is escaped."""

import json
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from studies.catalog.study import Study, command_line
from studies.metrics.cells import MISSING, plain, value_cell
from studies.metrics.metrics import METRICS
from studies.metrics.table import UNRESOLVED
from studies.plots.style.style import heading, readable
from studies.report.page.findings import Finding
from studies.report.page.svg import inline

COLUMNS = {
    "force_end": "force",
    "mean_error": "displacement, mean",
    "shape_error": "shape / size",
    "shape_volume": "volume of the shape",
    "volume_worst": "worst |V/V0 − 1|",
    "real_time": "simulated / computing",
    "interior_error": "interior, rel. L2",
    "silhouette_error": "silhouette / size",
    "min_j": "min J",
    "frame_time": "frame",
}
"""Metrics that the page's table shows where they are measured, the most asked for first; the CSV holds them all."""
SIGNED = ("force_end", "shape_volume")
AFTER = {"nodes": "nodes", "dt/dt_c": "step / limit", "law": "law", "status": "status", "study": "study"}
"""Columns behind the metrics, and their heads."""
NUMBERS = ("nodes", "dt/dt_c")
JUDGED = ("force_end", "mean_error", "real_time")
"""Rows with one of these come before rows without: a stability map has hundreds of those."""


def findings_html(found: Sequence[Finding]) -> str:
    """A list; a sentence where there is nothing to tell."""
    if not found:
        return "<p>None yet: nothing that a finding is read from is stored.</p>"
    items = [
        f'<li><h3>{escape(one.title)}</h3><span class="number">{_whole(one.number)}</span>'
        f"<p>{_whole(one.text)}</p></li>"
        for one in found
    ]
    return f'<ul class="findings">{"".join(items)}</ul>'


def _whole(text: str) -> str:
    """Escaped, with numbers that no line end parts from their uncertainty and unit."""
    return escape(text).replace(" ± ", "\u00a0±\u00a0").replace(" %", "\u00a0%").replace(" × ", "\u00a0×\u00a0")


def charts_html(charts: Mapping[str, Sequence[Mapping[str, str]]], questions: Mapping[str, str]) -> str:
    """A tab for each study that has charts (file, svg), by name."""
    shown = {name: found for name, found in charts.items() if found}
    if not shown:
        return "<p>No charts yet.</p>"
    tabs = [
        f'<button type="button" role="tab" id="tab-{escape(name)}" aria-controls="panel-{escape(name)}">'
        f"{escape(heading(name))}</button>"
        for name in shown
    ]
    panels = [_panel(name, found, questions[name]) for name, found in shown.items()]
    return f'<div role="tablist" aria-label="Studies">{"".join(tabs)}</div>{"".join(panels)}'


def _panel(name: str, charts: Sequence[Mapping[str, str]], question: str) -> str:
    figures = []
    for chart in charts:
        words = f"{heading(name)}: {chart['file'].rsplit('.', 1)[0]}"
        svg = inline(chart["svg"], f"{name}-{chart['file'].replace('.', '-')}", words)
        # Wider than a small window: what scrolls can be reached by keys.
        label = escape(words, quote=True)
        figures.append(f'<figure class="chart" role="group" aria-label="{label}" tabindex="0">{svg}</figure>')
    return (
        f'<div role="tabpanel" id="panel-{escape(name)}" aria-labelledby="tab-{escape(name)}">'
        f'<p class="soft">{escape(question)}</p>{"".join(figures)}</div>'
    )


def table_html(rows: Sequence[Mapping[str, Any]], known: Mapping[str, Any]) -> str:
    """Rows (as `study_table`, with "study" and "case") as a table, those with errors or times first; the name of a case
    that is `known` is a link that opens it."""
    metrics = {metric.name: metric for metric in METRICS if metric.name in COLUMNS}
    shown = [
        name for name in COLUMNS if name in metrics and any(_value(row, metrics[name]) is not None for row in rows)
    ]
    heads = [_head("case", "text", "")]
    heads += [_head(f"{COLUMNS[name]} [{metrics[name].unit}]", "number", metrics[name].description) for name in shown]
    heads += [_head(words, "number" if name in NUMBERS else "text", "") for name, words in AFTER.items()]
    judged = [metrics[name] for name in JUDGED if name in metrics]
    body = []
    for row in sorted(rows, key=lambda row: all(_value(row, metric) is None for metric in judged)):
        cells = [_name_cell(row, known), *(_metric_cell(row, metrics[name]) for name in shown)]
        body.append(f"<tr>{''.join(cells)}{''.join(_word_cell(row.get(name), name) for name in AFTER)}</tr>")
    return f'<table id="cases"><thead><tr>{"".join(heads)}</tr></thead><tbody>{"".join(body)}</tbody></table>'


def _head(words: str, kind: str, description: str) -> str:
    title = f' title="{escape(description, quote=True)}"' if description else ""
    return f'<th scope="col" data-kind="{kind}"{title}><button type="button">{escape(words)}</button></th>'


def _name_cell(row: Mapping[str, Any], known: Mapping[str, Any]) -> str:
    """Scene, body and method; an entry from outside is marked as one, and so is a run that did not end well."""
    scene = escape(readable(row["scene"]))
    case = known.get(row["case"])
    if case is not None:
        title = escape(case["title"], quote=True)
        scene = f'<a href="#case={escape(row["case"])}" title="{title}">{scene}</a>'
    marks = ["entry"] if row.get("entry") else []
    marks += [row["status"]] if row["status"] != "ok" else []
    marked = "".join(f' <span class="entry">{escape(str(mark))}</span>' for mark in marks)
    lines = (f"{scene}{marked}", escape(f"{row['body']}, {row['nodes']} nodes"), escape(str(row["method"])))
    order = escape(f"{row['scene']} {row['body']} {row['nodes']} {row['method']}", quote=True)
    return f'<th scope="row" data-sort="{order}">{"".join(f"<span>{line} </span>" for line in lines)}</th>'


def _word_cell(value: Any, name: str) -> str:
    if value is None:
        return f'<td data-sort="">{MISSING}</td>'
    if name in NUMBERS:
        return f'<td class="number" data-sort="{float(value):.6g}">{plain(float(value))}</td>'
    return f'<td class="words">{escape(readable(str(value)))}</td>'


def _value(row: Mapping[str, Any], metric: Any) -> float | None:
    return row.get(f"{metric.name} [{metric.unit}]")


def _metric_cell(row: Mapping[str, Any], metric: Any) -> str:
    value = _value(row, metric)
    if value is None:
        return f'<td class="number" data-sort="">{MISSING}</td>'
    floor = row.get(f"{metric.name} floor [{metric.unit}]")
    doubtful = metric.name in str(row.get(UNRESOLVED) or "").split()
    # A volume is compared with the body's own: the reference's floor is none of its.
    known = float("nan") if floor is None or metric.name == "volume_worst" else float(floor)
    cell = value_cell(float(value), known, signed=metric.name in SIGNED, unresolved=doubtful)
    return f'<td class="number" data-sort="{abs(float(value)):.6g}">{cell}</td>'


def again_html(studies: Sequence[Study], machine: Mapping[str, Any]) -> str:
    """Commands that make all of it again, and where the times were measured."""
    own = [study for study in studies if study.word]
    commands = [command_line("run", studies, elsewhere=True), command_line("report", own, elsewhere=True)]
    lines = "<br>".join(f"<code>{escape(command)}</code>" for command in commands)
    facts = [str(machine[name]) for name in ("cpu", "system", "python") if machine.get(name)]
    facts += [f"{name} {version}" for name, version in machine.get("packages", {}).items() if version]
    measured = f'<p class="soft">The machine: {escape(", ".join(facts))}.</p>' if facts else ""
    return f"<p>{lines}</p>{measured}"


def script_json(data: Any) -> str:
    """JSON that no HTML parser can take for the end of a script."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    for letter in "<>&\u2028\u2029":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return text
