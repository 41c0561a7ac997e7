"""What the page shows of one study, gathered while its runs are at hand and kept until they change."""

import json
import math
from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from studies.base.atomic import write_whole
from studies.catalog.study import Study
from studies.exchange.entry import is_entry
from studies.metrics.run import Run
from studies.report.page.case_data import Truths, case_data
from studies.report.page.entry_data import entry_data
from studies.runs.current import case_path
from studies.store.paths import key_hash

Part = dict[str, Any]
"""rows: of the study's table, with the id of each case and whether it is an entry from outside; cases: by id; charts:
file, title and SVG; remarks."""


def part_path(root: Path, study: Study) -> Path:
    """Where the part of a study is kept between two reports."""
    return root / "cache" / f"{study.name}.page.json"


def write_part(root: Path, study: Study, runs: Sequence[Run], table: pd.DataFrame, pictures: Mapping[str, str]) -> None:
    """Gathers and keeps the part of a study and of the entries from outside in its scenes; `table` has a row for each
    of `runs`, `pictures` its charts as SVG by the names of their files."""
    ids = [run_id(run) for run in runs]
    rows = [{name: _plain(value) for name, value in row.items()} for row in table.to_dict("records")]
    cases: dict[str, Any] = {}
    truths = Truths()
    for number, run in zip(ids, runs, strict=True):
        cases.setdefault(number, _data(root, study, run, truths))
    files = [chart.file for chart in study.charts]
    charts = [{"file": name, "svg": pictures[name]} for name in files if name in pictures]
    remarks = [
        f"chart {name} is left out: it was not drawn by studies.plots.style.style.save"
        for name in files
        if name not in pictures
    ]
    theirs = [is_entry(run.case) for run in runs]
    rows = [{**row, "case": n, "entry": entry} for row, n, entry in zip(rows, ids, theirs, strict=True)]
    part: Part = {"rows": rows, "cases": cases, "charts": charts, "remarks": remarks}
    write_whole(part_path(root, study), json.dumps(part, allow_nan=False).encode())


def read_part(root: Path, study: Study) -> Part | None:
    """None where none is kept."""
    path = part_path(root, study)
    return json.loads(path.read_bytes()) if path.is_file() else None


def _data(root: Path, study: Study, run: Run, truths: Truths) -> dict[str, Any]:
    if is_entry(run.case):
        return entry_data(run, truths)
    return case_data(run, _named(root, case_path(root, study.name, run.case)), truths)


def run_id(run: Run) -> str:
    """The same for runs with the same numbers, whatever is recorded beside them; of an entry the same in all studies
    with its scene."""
    return key_hash(run.record.key if is_entry(run.case) else run.case.replaced(recorded=()).key)


def _named(root: Path, path: Path) -> Path:
    """As the command names it where the results folder lies: nobody's other folders are told."""
    return root.name / path.relative_to(root)


def _plain(value: Hashable) -> Hashable:
    """As JSON has it: no NaN, no numpy."""
    value = value.item() if hasattr(value, "item") else value  # pyright: ignore[reportAttributeAccessIssue]
    return None if isinstance(value, float) and not math.isfinite(value) else value
