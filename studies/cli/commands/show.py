"""`organbench show`: a results file for the eye: what it is, how it ended, what is in it."""

from collections import Counter
from pathlib import Path
from typing import Annotated

import h5py
import numpy as np
import typer
from rich.columns import Columns
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from studies.base.counting import amounts
from studies.cli.terminal import console
from studies.store.entry import Entry, read_entry
from studies.store.ledger import Ledger
from studies.store.opening import open_results
from studies.store.paths import TIMING
from studies.store.record import INDEX_KIND, Field, Record, Status, read_record
from studies.store.schema import LAYOUTS

REFERENCES = "reference"
"""Folder of the references, which belong to no study."""
LEAVES = 200
"""Files of a study that are named; `--all` names the rest."""
WIDE, NARROW = 120, 70
"""Columns of a terminal from which descriptions stand next to the numbers, and below which shape and unit go."""


def show(
    path: Annotated[Path, typer.Argument(help="results/STUDY/CASE.h5, or a study's index results/STUDY/STUDY.h5")],
    every: Annotated[bool, typer.Option("--all", help="also the case as JSON and the meaning of each field")] = False,
) -> None:
    """Show a results file: status, numbers, fields with units."""
    console.print(describe(path, console.width, every), soft_wrap=False)  # long lines go on below


def describe(path: Path, width: int = WIDE, every: bool = True) -> Tree:
    """A rich tree of the results file `path`: header, attributes, fields with shape, unit and range, and if `every`
    with the case as JSON and what the fields mean; or, of a study's index, its cases with their status.

    Raises StudyError as read_record does."""
    path = Path(path)
    with open_results(path) as file:
        links = _links(file) if file.attrs.get("kind") == INDEX_KIND else None
    return _index(path, links, every) if links is not None else _record(path, read_record(path), width, every)


def _record(path: Path, record: Record, width: int, every: bool) -> Tree:
    tree = Tree(Text.assemble((record.name, "bold"), f"\n{record.kind} in {path.name}"))
    tree.add(_verdict(record.status, record.message))
    origin = f"machine {record.machine or '-'}, code {record.fingerprint[:8] or '-'}, schema {record.schema}"
    tree.add(Text(origin))
    if every:
        tree.add(Text("case " + record.key))
    if record.attributes:
        numbers = tree.add("attributes")
        units = _units(record.kind)
        texts = [
            Text(f"{name} = {_number(value)} {units.get(name, '')}".rstrip())
            for name, value in sorted(record.attributes.items())
        ]
        numbers.add(Columns(texts, padding=(0, 3), column_first=True))
    if record.fields:
        tree.add(_table(record.fields, width))
    lost = {name: n for name, field in sorted(record.fields.items()) if (n := _not_finite(field.values))}
    if lost:
        tree.add(Text("not finite: " + ", ".join(f"{n} of {name}" for name, n in lost.items())))
    if every and width < WIDE:
        meanings = tree.add("meaning")
        for name, field in sorted(record.fields.items()):
            meanings.add(Text(f"{name}: {field.description}"))
    return tree


def _verdict(status: str, message: str) -> Text:
    colour = "green" if status == Status.OK else "red"
    return Text.assemble(("status " + status, colour), f": {message}" if message else "")


def _table(fields: dict[str, Field], width: int) -> Table:
    headings = ["field", "shape", "unit", "min", "max", "last"] + ["meaning"] * (width >= WIDE)
    table = Table(box=None, pad_edge=False)
    shown = [k for k, heading in enumerate(headings) if width >= NARROW or heading in ("field", "min", "max")]
    for k in shown:
        numbers = headings[k] in ("min", "max", "last")
        table.add_column(headings[k], justify="right" if numbers else "left", no_wrap=headings[k] != "meaning")
    for name, item in sorted(fields.items()):
        shape = " x ".join(map(str, item.values.shape)) or "scalar"
        cells = (name, shape, item.unit, *_range(item.values), item.description)
        table.add_row(*(Text(cells[k]) for k in shown))
    return table


def _not_finite(values: np.ndarray) -> int:
    return int((~np.isfinite(values)).sum()) if values.dtype.kind == "f" else 0


def _range(values: np.ndarray) -> tuple[str, str, str]:
    """Smallest, largest and, of a series, last finite value, to four digits."""
    if values.dtype.kind not in "biuf" or values.size == 0:
        return "", "", ""
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return "", "", ""
    low, high, last = (f"{float(value):.4g}" for value in (finite.min(), finite.max(), finite[-1]))
    return low, high, last if values.ndim <= 1 else ""


def _units(kind: str) -> dict[str, str]:
    """Of the attributes of a kind of record that have one."""
    _, attributes = LAYOUTS.get(kind, ({}, {}))
    return {name: spec.unit for name, spec in attributes.items() if spec.unit != "1"}


def _number(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _links(file: h5py.File) -> dict[str, str]:
    links: dict[str, str] = {}

    def note(name: str, link: h5py.HardLink | h5py.SoftLink | h5py.ExternalLink) -> None:
        if isinstance(link, h5py.ExternalLink):
            links[name] = link.filename

    file.visititems_links(note)
    return links


def _index(path: Path, links: dict[str, str], every: bool) -> Tree:
    records = "reference" if path.stem == REFERENCES else "case"
    kinds = Counter("timing" if TIMING in file else records for file in links.values())
    tree = Tree(Text.assemble((path.stem, "bold"), f"  (index of {amounts(kinds)}, {path})"))
    entries, branches = _entries(path), {"": tree}
    leaves = Counter[str]()
    for name in sorted(links):
        *folders, leaf = name.split("/")
        for depth in range(1, len(folders) + 1):
            folder = "/".join(folders[:depth])
            if folder not in branches:
                branches[folder] = branches["/".join(folders[: depth - 1])].add(Text(folders[depth - 1]))
        place = "/".join(folders)
        leaves[place] += 1
        if every or leaves[place] <= LEAVES:
            entry = entries.get(links[name]) or read_entry(path.parent / links[name])
            branches[place].add(Text.assemble(leaf + "  ", _brief(entry)))
    for place, count in leaves.items():
        if not every and count > LEAVES:
            branches[place].add(Text(f"and {count - LEAVES} more (--all names them)"))
    return tree


def _entries(path: Path) -> dict[str, Entry]:
    """The ledger's entries for files next to a study's index; none where the index lies in no results folder."""
    folder = path.absolute().parent
    return Ledger(folder.parent).files(folder.name) if folder.name == path.stem else {}


def _brief(entry: Entry) -> Text:
    return Text(entry.error_message, style="red") if entry.fault else _verdict(entry.status, entry.message)
