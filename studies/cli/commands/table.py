"""`organbench table`: the metrics of a study, a row per case."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog import Study
from studies.cli.terminal import Results, StudyName, busy, console, say, warn
from studies.exchange.entry import entries_beside
from studies.metrics.cells import MISSING, plain, value_cell
from studies.metrics.metric import Metric
from studies.metrics.metrics import METRICS
from studies.metrics.table import MISSES, NOTES, PROCESSOR, UNRESOLVED, frame_of, marked, row_of
from studies.metrics.table import metric as metric_of
from studies.scene.quantities import ALWAYS
from studies.store.entry import DAMAGED
from studies.store.ledger import Ledger
from studies.store.tables import write_parquet, write_table
from studies.sweep.find_study import find_study
from studies.sweep.job import case_jobs
from studies.sweep.load import References, table_rows

Row = Mapping[Any, Any]
SETTINGS = {"law": "law {}", "nodes": "{} nodes", "stiffness": "stiffness {}", "dt/dt_c": "dt = {} dt_c"}
"""What rows may differ by, besides scene, body and method."""


def table(
    study: StudyName,
    results: Results = Path("results"),
    csv: Annotated[Path | None, typer.Option(help="write all columns to this file instead of printing")] = None,
    parquet: Annotated[Path | None, typer.Option(help="the same as Parquet, with all digits and typed columns")] = None,
    metrics: Annotated[str, typer.Option(help="separated by commas; default: those of the study")] = "",
    every: Annotated[bool, typer.Option("--all", help="all metrics, in several blocks where they do not fit")] = False,
) -> None:
    """Print one row per case with the metrics of a study. ± is the uncertainty of the reference."""
    entry = find_study(study)
    own = [metric_of(column) for column in entry.columns]
    metrics_by_name = {m.name: m for m in (*METRICS, *own)}
    chosen = [lookup(name.strip(), metrics_by_name, "metric") for name in metrics.split(",")] if metrics else own
    references = References(Ledger(results))
    with busy(f"reading the records of {entry.name}"):
        rows, remarks = table_rows(references, entry, chosen)
    entries, unreadable = entries_beside(results, entry.scenes, references.of)
    rows += [row_of(run, chosen) for run in entries]
    if not rows:
        warn(unreadable)
        raise StudyError(why_empty(references.ledger, entry, study))
    warn([*remarks, *unreadable])
    written = [path for path in (csv, parquet) if path is not None]
    if written:
        frame = frame_of(rows)
        for write, path in ((write_table, csv), (write_parquet, parquet)):
            if path is not None:
                say(write(path, frame))
        return
    draw(rows, chosen, every)


def why_empty(ledger: Ledger, study: Study, word: str) -> str:
    """Why no case of a study has a row. word: what the user calls the study."""
    stored = [entry for job in case_jobs(ledger.root, study) if (entry := ledger.entry(job)) is not None]
    if not stored:
        return f"nothing of {word} is stored in {ledger.root}; run `organbench run {word}` first"
    state = "damaged" if {entry.fault for entry in stored} == {DAMAGED} else "unreadable"
    return f"all stored records of {word} are {state} ({len(stored)}); `organbench run {word}` computes them again"


def draw(rows: Sequence[Row], metrics: list[Metric], every: bool) -> None:
    """What all rows share in a line, then as many metrics as the terminal is wide, or all in blocks: below a heading
    for each scene and body, at the left what each row is called."""
    shared = [words.format(setting(rows[0], key)) for key, words in SETTINGS.items() if len(values(rows, key)) == 1]
    if shared:
        say(", ".join(shared))
    groups: dict[str, list[int]] = {}
    for number, row in enumerate(rows):
        groups.setdefault(f"{row['scene']}, {row['body']}", []).append(number)
    of_groups = [[rows[number] for number in numbers] for numbers in groups.values()]
    differing = [key for key in SETTINGS if any(len(values(group, key)) > 1 for group in of_groups)]
    of_heading = [key for key in SETTINGS if key not in differing and len(values(rows, key)) > 1]
    height = 1 + max((len(metric.name.split("_")) for metric in metrics), default=0)
    labels = [column(height, [""], [f"  {marked(row)}" for row in rows], str.ljust)]
    labels += [column(height, [key], [setting(row, key) for row in rows], str.ljust) for key in differing]
    if any(row["status"] != "ok" for row in rows):
        labels.append(column(height, ["status"], [row["status"] for row in rows], str.ljust))
    rest = list(metrics)
    while rest:
        columns, width = list(labels), sum(len(label[-1]) + 2 for label in labels) - 2
        for metric in rest:
            one = column(
                height, [*metric.name.split("_"), f"[{metric.unit}]"], [cell(row, metric) for row in rows], str.rjust
            )
            width += 2 + len(one[-1])
            if len(columns) > len(labels) and width > console.width:
                break
            columns.append(one)
        lines = ["  ".join(texts).rstrip() for texts in zip(*columns, strict=True)]
        say("\n".join(filter(None, lines[: -len(rows)])))
        for name, numbers in groups.items():
            first = rows[numbers[0]]
            say(", ".join([name, *(SETTINGS[key].format(setting(first, key)) for key in of_heading)]))
            for number in numbers:
                say(lines[number - len(rows)])
        rest = rest[len(columns) - len(labels) :]
        if not every:
            break
    for note in (note for key, note in NOTES.items() if any(row.get(key) for row in rows)):
        say(note)
    processors = dict.fromkeys(row[PROCESSOR] for row in rows if row.get(PROCESSOR))
    if processors:
        say(f"processor: {', '.join(processors)}")
    if rest:
        say(f"not shown (--all, --csv FILE, --metrics): {', '.join(metric.name for metric in rest)}")


def column(height: int, head: list[str], cells: list[str], justified: Callable[[str, int], str]) -> list[str]:
    """Texts of one width below one another: `height` lines that end with the head, then the cells."""
    texts = [""] * (height - len(head)) + head + cells
    width = max(map(len, texts))
    return [justified(text, width) for text in texts]


def values(rows: Sequence[Row], key: str) -> set[str]:
    rows_by_value = {row[key]: row for row in rows}
    return {setting(row, key) for row in rows_by_value.values()}


def setting(row: Row, key: str) -> str:
    value = row[key]
    if isinstance(value, str):
        return value
    return MISSING if value != value else f"{value:.2g}" if key == "dt/dt_c" else plain(value)


def cell(row: Row, metric: Metric) -> str:
    """A metric of a row with its uncertainty; a volume is compared with the body's own, which is known."""
    has_floor = metric.quantity is not None and metric.quantity not in ALWAYS
    uncertainty = float(row.get(f"{metric.name} floor [{metric.unit}]", "nan")) if has_floor else float("nan")
    unresolved, misses = (metric.name in str(row[column]).split() for column in (UNRESOLVED, MISSES))
    return value_cell(
        float(row[f"{metric.name} [{metric.unit}]"]),
        uncertainty,
        signed=metric.better == "-",
        unresolved=unresolved,
        missed=misses,
    )
