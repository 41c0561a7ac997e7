"""The parts of the page as HTML: findings, charts behind tabs, the table of all cases, commands. Text is escaped."""

import json
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from studies.metrics.cells import MISSING, plain, value_cell
from studies.metrics.metrics import METRICS
from studies.metrics.table import UNRESOLVED
from studies.plots.style.style import heading, readable
from studies.report.page.findings import Finding
from studies.report.page.svg import inline

COLUMNS = {
    "volume_worst": "worst |V/V0 − 1|",
    "force_end": "force",
    "mean_error": "displacement, mean",
    "interior_error": "interior, rel. L2",
    "silhouette_error": "silhouette / size",
    "min_j": "min J",
    "frame_time": "frame",
    "real_time": "simulated / computing",
}
"""Metrics that the page's table shows; the CSV holds them all."""
SIGNED = ("force_end",)
BEFORE = {"scene": "scene", "body": "body", "nodes": "nodes", "method": "method"}
AFTER = {"dt/dt_c": "step / limit", "status": "status", "law": "law", "study": "study"}
"""Columns of words on both sides of the metrics, and their heads."""
NUMBERS = ("nodes", "dt/dt_c")


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
    """Rows (as `study_table`, with "study" and "case") as a table, those with a replay first; a button opens the cases
    that are `known`."""
    metrics = {metric.name: metric for metric in METRICS if metric.name in COLUMNS}
    shown = [name for name in COLUMNS if any(_value(row, metrics[name]) is not None for row in rows)]
    heads = [_head("case", "text", ""), *(_word_head(name, words) for name, words in BEFORE.items())]
    heads += [_head(f"{COLUMNS[name]} [{metrics[name].unit}]", "number", metrics[name].description) for name in shown]
    heads += [_word_head(name, words) for name, words in AFTER.items()]
    body = []
    for number, row in enumerate(sorted(rows, key=lambda row: "replay" not in known.get(row["case"], {})), 1):
        cells = [_open_cell(row, number, known), *(_before_cell(row, name) for name in BEFORE)]
        cells += [_metric_cell(row, metrics[name]) for name in shown]
        cells += [_word_cell(row.get(name), name) for name in AFTER]
        body.append(f"<tr>{''.join(cells)}</tr>")
    return f'<table id="cases"><thead><tr>{"".join(heads)}</tr></thead><tbody>{"".join(body)}</tbody></table>'


def _head(words: str, kind: str, description: str) -> str:
    title = f' title="{escape(description, quote=True)}"' if description else ""
    return f'<th scope="col" data-kind="{kind}"{title}><button type="button">{escape(words)}</button></th>'


def _open_cell(row: Mapping[str, Any], number: int, known: Mapping[str, Any]) -> str:
    case = known.get(row["case"])
    if case is None:
        return f'<th scope="row" data-sort="{number}">{number}</th>'
    words = "Replay" if "replay" in case else "Histories"
    label = escape(f"{words} of {case['title']}", quote=True)
    button = f'<button type="button" data-case="{escape(row["case"])}" aria-label="{label}">{words}</button>'
    return f'<th scope="row" data-sort="{words} {number}">{button}</th>'


def _word_head(name: str, words: str) -> str:
    return _head(words, "number" if name in NUMBERS else "text", "")


def _word_cell(value: Any, name: str) -> str:
    if value is None:
        return f'<td data-sort="">{MISSING}</td>'
    if name in NUMBERS:
        return f'<td class="number" data-sort="{float(value):.6g}">{plain(float(value))}</td>'
    return f'<td class="words">{escape(readable(str(value)))}</td>'


def _before_cell(row: Mapping[str, Any], name: str) -> str:
    """A column of BEFORE; an entry from outside has the name that it gave itself, and is marked as one."""
    if name != "method" or not row.get("entry"):
        return _word_cell(row.get(name), name)
    return f'<td class="words">{escape(str(row["method"]))} <span class="entry">entry</span></td>'


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


def again_html(studies: Sequence[str], machine: Mapping[str, Any]) -> str:
    """Commands that make all of it again, and where the times were measured."""
    commands = [f"organbench run {' '.join(studies)}", "organbench report"]
    lines = "<br>".join(f"<code>{escape(command)}</code>" for command in commands)
    facts = [str(machine[name]) for name in ("cpu", "system", "python") if machine.get(name)]
    facts += [f"{name} {version}" for name, version in machine.get("packages", {}).items() if version]
    told = f'<p class="soft">The machine: {escape(", ".join(facts))}.</p>' if facts else ""
    return f"<p>{lines}</p>{told}"


def script_json(data: Any) -> str:
    """JSON that no HTML parser can take for the end of a script."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    for letter in "<>&\u2028\u2029":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return text
