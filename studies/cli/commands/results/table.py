"""`organbench table`: the metrics of a study, a row per case."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from studies.base.lookup import lookup
from studies.cli.terminal import Results, StudyName, console, say, warn
from studies.exchange.entry import entries_beside
from studies.metrics.cells import MISSING, UNRESOLVED_MARK, plain, value_cell
from studies.metrics.metric import Metric
from studies.metrics.metrics import METRICS
from studies.metrics.table import UNRESOLVED, study_table
from studies.metrics.table import metric as metric_of
from studies.scene.quantities import ALWAYS
from studies.store.csv_table import write_table
from studies.store.parquet_table import write_parquet
from studies.sweep.find_study import find_study
from studies.sweep.load import load_runs

Row = Mapping[Any, Any]
SETTINGS = {"law": "law {}", "nodes": "{} nodes", "stiffness": "stiffness {}", "dt/dt_c": "dt = {} dt_c"}
"""What rows may differ by, beside scene, body and method."""


def table(
    study: StudyName,
    results: Results = Path("results"),
    csv: Annotated[Path | None, typer.Option(help="write it there instead of printing it, with all columns")] = None,
    parquet: Annotated[Path | None, typer.Option(help="the same as Parquet: all digits, typed columns")] = None,
    metrics: Annotated[str, typer.Option(help="names with commas, instead of the study's own")] = "",
    every: Annotated[bool, typer.Option("--all", help="all metrics, below one another where they do not fit")] = False,
) -> None:
    """One row per case, with the metrics of the study; ± is the uncertainty of the reference."""
    entry = find_study(study)
    own = [metric_of(column) for column in entry.columns]
    known = {m.name: m for m in (*METRICS, *own)}
    chosen = [lookup(name.strip(), known, "metric") for name in metrics.split(",")] if metrics else own
    runs, remarks = load_runs(results, entry)
    entries, unreadable = entries_beside(results, entry.scenes, runs)
    runs += entries
    warn([*remarks, *unreadable])
    frame = study_table(runs, chosen)
    written = [write(path, frame) for write, path in ((write_table, csv), (write_parquet, parquet)) if path is not None]
    for path in written:
        say(path)
    if written:
        return
    rows = frame.to_dict("records")
    if not rows:
        say("nothing is stored of it yet: `organbench run` does that")
        return
    draw(rows, chosen, every)


def draw(rows: Sequence[Row], metrics: list[Metric], every: bool) -> None:
    """What all rows share in a line, then as many metrics as the terminal is wide, or all in blocks."""
    shared = [words.format(setting(rows[0], key)) for key, words in SETTINGS.items() if len(values(rows, key)) == 1]
    if shared:
        say(", ".join(shared))
    rest = list(metrics)
    while rest:
        count = fitting(rows, rest)
        for line in block(rows, rest[:count]):
            say(line)
        rest = rest[count:]
        if not every:
            break
    if any(row[UNRESOLVED] for row in rows):
        say(f"{UNRESOLVED_MARK} the reference is not ten times better than this error")
    if rest:
        say(f"not shown (--all, --csv FILE, --metrics): {', '.join(metric.name for metric in rest)}")


def fitting(rows: Sequence[Row], metrics: list[Metric]) -> int:
    """How many of the first metrics fit beside the labels; one at least."""
    for count in range(len(metrics), 1, -1):
        if max(map(len, block(rows, metrics[:count]))) <= console.width:
            return count
    return 1


def block(rows: Sequence[Row], metrics: list[Metric]) -> list[str]:
    """Lines: a head with the units, then all rows, under a heading for each scene and body."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(f"{row['scene']}, {row['body']}", []).append(row)
    differing = [key for key in SETTINGS if any(len(values(group, key)) > 1 for group in groups.values())]
    shared = [key for key in SETTINGS if key not in differing and len(values(rows, key)) > 1]
    ended = ["status"] if any(row["status"] != "ok" for row in rows) else []
    heads = [[""], *([key] for key in (*differing, *ended)), *(head(metric) for metric in metrics)]
    height, left = max(map(len, heads)), 1 + len(differing) + len(ended)
    table = [[""] * (height - len(lines)) + lines for lines in heads]
    for row in rows:
        labels = [f"  {row['method']}", *(setting(row, key) for key in differing), *(row[key] for key in ended)]
        for column, text in zip(table, [*labels, *(cell(row, metric) for metric in metrics)], strict=True):
            column.append(text)
    widths = [max(map(len, column)) for column in table]
    texts = [
        "  ".join(
            text.ljust(width) if k < left else text.rjust(width)
            for k, (text, width) in enumerate(zip(line, widths, strict=True))
        )
        for line in zip(*table, strict=True)
    ]
    lines, drawn = texts[:height], dict(zip(map(id, rows), texts[height:], strict=True))
    for heading, group in groups.items():
        lines.append(", ".join([heading, *(SETTINGS[key].format(setting(group[0], key)) for key in shared)]))
        lines += [drawn[id(row)] for row in group]
    return [line.rstrip() for line in lines]


def head(metric: Metric) -> list[str]:
    """Its name, word by word, and its unit."""
    return [*metric.name.split("_"), f"[{metric.unit}]"]


def values(rows: Sequence[Row], key: str) -> set[str]:
    """What a setting is in the rows, as it is printed."""
    return {setting(row, key) for row in rows}


def setting(row: Row, key: str) -> str:
    """A setting as it is printed."""
    value = row[key]
    if isinstance(value, str):
        return value
    return MISSING if value != value else f"{value:.2g}" if key == "dt/dt_c" else plain(value)


def cell(row: Row, metric: Metric) -> str:
    """A metric of a row beside its uncertainty; a volume is compared with the body's own, which is known."""
    known = metric.quantity is not None and metric.quantity not in ALWAYS
    uncertainty = float(row.get(f"{metric.name} floor [{metric.unit}]", "nan")) if known else float("nan")
    unresolved = metric.name in str(row[UNRESOLVED]).split()
    return value_cell(
        float(row[f"{metric.name} [{metric.unit}]"]), uncertainty, signed=metric.better == "-", unresolved=unresolved
    )
