"""`organbench compare`: what moved between two results folders."""

from pathlib import Path
from typing import Annotated

import typer

from studies.cli.terminal import say
from studies.compare.folders import Change, Comparison
from studies.compare.folders import compare as compared
from studies.compare.verdict import MEANING
from studies.metrics.cells import MISSING, plain
from studies.store.tables.csv_table import write_table

SHOWN = 40
"""Rows of what moved that are printed."""


def compare(
    old: Annotated[Path, typer.Argument(help="a results folder, such as results/published")],
    new: Annotated[Path, typer.Argument(help="another one")] = Path("results"),
    csv: Annotated[Path | None, typer.Option(help="file for every number of every case")] = None,
) -> None:
    """Every number that two results folders share: which are the same, and which moved.

    Prints Markdown. Exit code 1 where something moved.
    """
    found = compared(old, new)
    for line in lines_of(found):
        say(line)
    if csv is not None:
        say(f"\nwritten to {write_table(csv, found.table())}")
    raise typer.Exit(1 if found.moved else 0)


def lines_of(found: Comparison) -> list[str]:
    """The comparison in Markdown."""
    counts = [f"| {verdict} | {count} | {MEANING[verdict]} |" for verdict, count in found.counts().items()]
    lines = ["| verdict | numbers | meaning |", "|---|---|---|", *counts, ""]
    if found.only_old or found.only_new:
        lines += [f"Cases in the first folder alone: {found.only_old}, in the second alone: {found.only_new}.", ""]
    if not found.moved:
        return [*lines, "Nothing moved."]
    lines += [
        "| study | scene | body, method | metric | old | new | change | known to |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [row_of(change) for change in found.moved[:SHOWN]]
    left = len(found.moved) - SHOWN
    return [*lines, "", f"{left} more have moved; --csv FILE has them all"] if left > 0 else lines


def row_of(change: Change) -> str:
    """A row of what moved."""
    case = change.case
    names = [case.study, case.scene, f"{case.body}, {case.method}"]
    if isinstance(change.old, str) or isinstance(change.new, str):
        return "| " + " | ".join([*names, change.metric, str(change.old), str(change.new), MISSING, MISSING]) + " |"
    numbers = [plain(change.old), plain(change.new), plain(change.new - change.old, "+"), plain(change.floor)]
    return "| " + " | ".join([*names, f"{change.metric} [{change.unit}]", *numbers]) + " |"
