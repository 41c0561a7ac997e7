"""`organbench compare`: what moved between two results folders."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from studies.cli.terminal import busy, console, say
from studies.metrics.cells import MISSING, plain
from studies.metrics.change import Change, Verdict, labels_of
from studies.metrics.compare_folders import Comparison
from studies.metrics.compare_folders import compare as compared
from studies.store.tables import write_table

SHOWN = 40
"""Rows of what moved that are printed."""
HEADS = ("study", "scene", "body, nodes, method", "metric", "old", "new", "change", "known to")


def compare(
    old: Annotated[Path, typer.Argument(help="a results folder, such as results/published")],
    new: Annotated[Path, typer.Argument(help="the other results folder")] = Path("results"),
    csv: Annotated[Path | None, typer.Option(help="write every number of every case to this file")] = None,
) -> None:
    """Compare two results folders number by number.

    Records are compared; tables only where a folder has no records. Times are compared only where one machine measured
    both. A table on a terminal, else Markdown. Exit code 1 where a record is missing or cannot be read, and where a
    number moved: an error by more than its uncertainty, a time by more than its spread, any other by more than
    round-off.
    """
    with busy(f"comparing {old} and {new}"):
        comparison = compared(old, new)
    for line in [*summary(comparison), *comparison.findings]:
        say(line)
    rows = rows_of(comparison.moved[:SHOWN], comparison)
    if rows and console.is_terminal:
        table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
        for number, heading in enumerate(HEADS):
            table.add_column(heading, justify="left" if number < HEADS.index("old") else "right", overflow="fold")
        for row in rows:
            table.add_row(*row)
        console.print(table)
    elif rows:
        say("\n".join(["", *(f"| {' | '.join(row)} |" for row in (HEADS, ["---"] * len(HEADS), *rows))]))
    left = len(comparison.moved) - len(rows)
    if left:
        say(f"{left} more have moved; --csv FILE has them all")
    if csv is not None:
        say(f"\nwritten to {write_table(csv, comparison.table())}")
    raise typer.Exit(1 if comparison.moved or comparison.findings else 0)


def summary(comparison: Comparison) -> list[str]:
    """How many numbers are the same and how many moved: accuracy first, then times."""
    lines = _counted("accuracy", comparison.counts(times=False))
    times, ratio = comparison.counts(times=True), f"median ratio {comparison.time_ratio:.2g} (new / old)"
    if sum(times.values()) and comparison.same_machine:
        lines += [*_counted("speed", times), f"  {ratio}"]
    elif sum(times.values()):
        machine = "another machine" if None not in comparison.machines else "machine not known"
        lines.append(f"speed: {machine}, {ratio}, {sum(times.values())} times not judged")
    other = comparison.counts(times=False)[Verdict.OTHER_REFERENCE]
    if other:
        lines.append(f"references: not the same in both folders, {other} errors not judged")
    if comparison.only_old or comparison.only_new:
        lines.append(
            f"cases in the first folder alone: {comparison.only_old}, in the second alone: {comparison.only_new}"
        )
    return lines


def _counted(what: str, counts: dict[Verdict, int]) -> list[str]:
    bits, unknown = counts[Verdict.SAME_BITS], counts[Verdict.NOT_RESOLVABLE]
    words = [
        f"{what}: {bits + counts[Verdict.ROUND_OFF]} equal",
        f"{counts[Verdict.WITHIN_FLOOR]} within uncertainty",
        f"{counts[Verdict.MOVED]} moved",
        *([f"{unknown} cannot be judged"] if unknown else []),
    ]
    return [", ".join(words), *([f"  {bits} of the equal ones to the last bit"] if bits else [])]


def rows_of(changes: Sequence[Change], comparison: Comparison) -> list[list[str]]:
    """A row for each change, under HEADS; no two are equal."""
    labels = labels_of(change.case for change in comparison.changes)
    return [[one.case.study, one.case.scene, labels[one.case], *_numbers(one)] for one in changes]


def _numbers(change: Change) -> list[str]:
    if isinstance(change.old, str) or isinstance(change.new, str):
        return [change.metric, str(change.old), str(change.new), MISSING, MISSING]
    numbers = [plain(change.old), plain(change.new), plain(change.new - change.old, "+"), plain(change.floor)]
    return [f"{change.metric} [{change.unit}]", *numbers]
