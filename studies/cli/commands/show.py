"""A results file for the eye: what it is, how it ended, what is in it. Used by `organbench show`."""

from pathlib import Path

import h5py
import numpy as np
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from studies.base.errors import StudyError
from studies.store.record import INDEX_KIND, Field, Record, Status, open_results, peek, read_record


def describe(path: Path) -> Tree:
    """A rich tree of the results file `path`: header, attributes, fields with shape, unit, range and description; or,
    of a study's index, its cases with their status. Raises StudyError as read_record does."""
    path = Path(path)
    with open_results(path) as file:
        links = _links(file) if file.attrs.get("kind") == INDEX_KIND else None
    return _index(path, links) if links is not None else _record(path, read_record(path))


def _record(path: Path, record: Record) -> Tree:
    tree = Tree(Text.assemble((record.name, "bold"), f"  ({record.kind}, {path.name})"))
    tree.add(_verdict(record))
    origin = f"machine {record.machine or '-'}, code {record.fingerprint[:8] or '-'}, schema {record.schema}"
    tree.add(Text(origin))
    tree.add(Text("case " + record.key))
    if record.attributes:
        numbers = tree.add("attributes")
        for name, value in sorted(record.attributes.items()):
            numbers.add(Text(f"{name} = {_number(value)}"))
    if record.fields:
        tree.add(_table(record.fields))
    return tree


def _verdict(record: Record) -> Text:
    colour = "green" if record.status == Status.OK else "red"
    return Text.assemble(("status " + record.status, colour), f": {record.message}" if record.message else "")


def _table(fields: dict[str, Field]) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in ("field", "shape", "unit", "min", "max", "last", "description"):
        table.add_column(heading, justify="right" if heading in ("min", "max", "last") else "left", overflow="fold")
    for name, item in sorted(fields.items()):
        shape = " x ".join(map(str, item.values.shape)) or "scalar"
        low, high, last = _range(item.values)
        table.add_row(*map(Text, (name, shape, item.unit, low, high, last, item.description)))
    return table


def _range(values: np.ndarray) -> tuple[str, str, str]:
    """Smallest, largest and last finite value; how many are not finite stands beside the last."""
    if values.dtype.kind not in "biuf" or values.size == 0:
        return "", "", ""
    finite = values[np.isfinite(values)]
    lost = values.size - finite.size
    note = f" ({lost} not finite)" if lost else ""
    if finite.size == 0:
        return "", "", note.strip()
    last = _number(finite[-1].item()) if values.ndim <= 1 else ""
    return _number(finite.min().item()), _number(finite.max().item()), last + note


def _number(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _links(file: h5py.File) -> dict[str, str]:
    found: dict[str, str] = {}

    def note(name: str, link: h5py.HardLink | h5py.SoftLink | h5py.ExternalLink) -> None:
        if isinstance(link, h5py.ExternalLink):
            found[name] = link.filename

    file.visititems_links(note)
    return found


def _index(path: Path, links: dict[str, str]) -> Tree:
    tree = Tree(Text.assemble((path.stem, "bold"), f"  (index of {len(links)} files, {path})"))
    branches: dict[str, Tree] = {"": tree}
    for name in sorted(links):
        *folders, leaf = name.split("/")
        for depth in range(1, len(folders) + 1):
            folder = "/".join(folders[:depth])
            if folder not in branches:
                branches[folder] = branches["/".join(folders[: depth - 1])].add(Text(folders[depth - 1]))
        try:
            verdict = _verdict(peek(path.parent / links[name]))
        except StudyError as problem:
            verdict = Text(str(problem), style="red")
        branches["/".join(folders)].add(Text.assemble(leaf + "  ", verdict))
    return tree
