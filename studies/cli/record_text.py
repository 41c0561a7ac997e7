"""A results file for the eye: what it is, how it ended, what is in it."""

from pathlib import Path

import numpy as np
from rich.columns import Columns
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from studies.store.record import Field, Status, read_record
from studies.store.schema import LAYOUTS


def describe(path: Path, every: bool) -> Tree:
    """A rich tree: header, attributes, fields with shape, unit and range, and if `every` with the case as JSON and what
    the fields mean.

    Raises StudyError as read_record does.
    """
    record = read_record(path)
    tree = Tree(Text.assemble((record.name, "bold"), f"\n{record.kind} in {path.name}"))
    colour = "green" if record.status == Status.OK else "red"
    message = f": {record.message}" if record.message else ""
    tree.add(Text.assemble(("status " + record.status, colour), message))
    tree.add(Text(f"machine {record.machine or '-'}, code {record.fingerprint[:8] or '-'}, schema {record.schema}"))
    if every:
        tree.add(Text("case " + record.key))
    if record.attributes:
        _, layout = LAYOUTS.get(record.kind, ({}, {}))
        units = {name: spec.unit for name, spec in layout.items() if spec.unit != "1"}
        texts = [
            Text(f"{name} = {_number(value)} {units.get(name, '')}".rstrip())
            for name, value in sorted(record.attributes.items())
        ]
        tree.add("attributes").add(Columns(texts, padding=(0, 3), column_first=True))
    if record.fields:
        tree.add(_table(record.fields))
    lost = {name: n for name, field in sorted(record.fields.items()) if (n := _not_finite(field.values))}
    if lost:
        tree.add(Text("not finite: " + ", ".join(f"{n} of {name}" for name, n in lost.items())))
    if every:
        meanings = tree.add("meaning")
        for name, field in sorted(record.fields.items()):
            meanings.add(Text(f"{name}: {field.description}"))
    return tree


def _table(fields: dict[str, Field]) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in ("field", "shape", "unit", "min", "max", "last"):
        justify = "right" if heading in ("min", "max", "last") else "left"
        table.add_column(heading, justify=justify, overflow="fold")
    for name, item in sorted(fields.items()):
        shape = " x ".join(map(str, item.values.shape)) or "scalar"
        cells = (name, shape, item.unit, *_range(item.values))
        table.add_row(*map(Text, cells))
    return table


def _not_finite(values: np.ndarray) -> int:
    return int((~np.isfinite(values)).sum()) if values.dtype.kind == "f" else 0


def _range(values: np.ndarray) -> tuple[str, str, str]:
    """Smallest, largest and, of a series, last finite value, to four digits."""
    finite = values[np.isfinite(values)] if values.dtype.kind in "biuf" else values[:0]
    if finite.size == 0:
        return "", "", ""
    low, high, last = (f"{float(value):.4g}" for value in (finite.min(), finite.max(), finite[-1]))
    return low, high, last if values.ndim <= 1 else ""


def _number(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
