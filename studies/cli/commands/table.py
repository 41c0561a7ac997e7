"""`organbench table`: the metrics of a study, a row per case."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog import Study
from studies.cli.terminal import Results, StudyName, console, say, warn
from studies.exchange.entry import entries_beside
from studies.metrics.cells import MISSING, UNRESOLVED_NOTE, plain, value_cell
from studies.metrics.metric import Metric
from studies.metrics.metrics import METRICS
from studies.metrics.table import UNRESOLVED, frame_of, row_of
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
    """What all rows share in a line, then as many metrics as the terminal is wide, or all in blocks."""
    shared = [words.format(setting(rows[0], key)) for key, words in SETTINGS.items() if len(values(rows, key)) == 1]
    if shared:
        say(", ".join(shared))
    layout, rest = Layout(rows), list(metrics)
    while rest:
        columns = layout.fitting(rest)
        say("\n".join(layout.block(columns)))
        rest = rest[len(columns) :]
        if not every:
            break
    if any(row[UNRESOLVED] for row in rows):
        say(UNRESOLVED_NOTE)
    if rest:
        say(f"not shown (--all, --csv FILE, --metrics): {', '.join(metric.name for metric in rest)}")


class Column(NamedTuple):
    """Texts below one another."""

    head: list[str]
    cells: list[str]

    @property
    def width(self) -> int:
        """Of the longest."""
        return max(map(len, (*self.head, *self.cells)))

    def filled(self, height: int, justified: Callable[[str, int], str]) -> list[str]:
        """All of one width, the head at the bottom of `height` lines."""
        width = self.width
        return [justified(text, width) for text in [""] * (height - len(self.head)) + self.head + self.cells]


class Layout:
    """Rows below a heading for each scene and body; at the left what each is called, then columns of metrics."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self.rows = rows
        self.groups: dict[str, list[int]] = {}
        for number, row in enumerate(rows):
            self.groups.setdefault(f"{row['scene']}, {row['body']}", []).append(number)
        groups = [[rows[number] for number in group] for group in self.groups.values()]
        differing = [key for key in SETTINGS if any(len(values(group, key)) > 1 for group in groups)]
        self.shared = [key for key in SETTINGS if key not in differing and len(values(rows, key)) > 1]
        ended = ["status"] if any(row["status"] != "ok" for row in rows) else []
        self.labels = [Column([""], [f"  {row['method']}" for row in rows])]
        self.labels += [Column([key], [setting(row, key) for row in rows]) for key in differing]
        self.labels += [Column([key], [row[key] for row in rows]) for key in ended]

    def heading(self, name: str) -> str:
        """Of a group: what all of its rows share."""
        first = self.rows[self.groups[name][0]]
        return ", ".join([name, *(SETTINGS[key].format(setting(first, key)) for key in self.shared)])

    def fitting(self, metrics: list[Metric]) -> list[Column]:
        """Columns of as many of the first metrics as fit next to the labels; one at least."""
        width, columns = sum(column.width + 2 for column in self.labels) - 2, list[Column]()
        for metric in metrics:
            column = Column(head(metric), [cell(row, metric) for row in self.rows])
            width += 2 + column.width
            if columns and width > console.width:
                break
            columns.append(column)
        return columns

    def block(self, columns: list[Column]) -> list[str]:
        """Lines: a head with the units, then all rows, under their headings."""
        height = max(len(column.head) for column in (*self.labels, *columns))
        texts = [column.filled(height, str.ljust) for column in self.labels]
        texts += [column.filled(height, str.rjust) for column in columns]
        lines = ["  ".join(line).rstrip() for line in zip(*texts, strict=True)]
        block = lines[:height]
        for name, numbers in self.groups.items():
            block += [self.heading(name), *(lines[height + number] for number in numbers)]
        return block


def head(metric: Metric) -> list[str]:
    """Its name, word by word, and its unit."""
    return [*metric.name.split("_"), f"[{metric.unit}]"]


def values(rows: Sequence[Row], key: str) -> set[str]:
    """What a setting is in the rows, as it is printed."""
    rows_by_value = {row[key]: row for row in rows}
    return {setting(row, key) for row in rows_by_value.values()}


def setting(row: Row, key: str) -> str:
    """A setting as it is printed."""
    value = row[key]
    if isinstance(value, str):
        return value
    return MISSING if value != value else f"{value:.2g}" if key == "dt/dt_c" else plain(value)


def cell(row: Row, metric: Metric) -> str:
    """A metric of a row with its uncertainty; a volume is compared with the body's own, which is known."""
    has_floor = metric.quantity is not None and metric.quantity not in ALWAYS
    uncertainty = float(row.get(f"{metric.name} floor [{metric.unit}]", "nan")) if has_floor else float("nan")
    unresolved = metric.name in str(row[UNRESOLVED]).split()
    return value_cell(
        float(row[f"{metric.name} [{metric.unit}]"]), uncertainty, signed=metric.better == "-", unresolved=unresolved
    )
