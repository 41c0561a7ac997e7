"""`organbench status`: what is done, what is not, and why."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from studies.base.counting import status_counts
from studies.catalog import STUDIES
from studies.cli.terminal import SMOKE, Results, Smoke, busy, console, say
from studies.reference.reference_solves import reference_solves
from studies.scene.scene import Scene
from studies.store.ledger import Ledger
from studies.sweep.find_study import find_study
from studies.sweep.standings import (
    SolveStanding,
    Standing,
    machines_of,
    mixture,
    solve_standing,
    standings,
    summary,
)

SHOWN = 8
"""Cases and reference solutions named per reason; `--all` names the rest."""


def status(
    study: Annotated[str, typer.Argument(help="a study, with its problems; default: all studies, in numbers")] = "",
    results: Results = Path("results"),
    smoke: Smoke = False,
    every: Annotated[bool, typer.Option("--all", help="name every problem and every mesh")] = False,
    check: Annotated[bool, typer.Option(help="verify the checksums of all files, not only changed ones")] = False,
) -> None:
    """Count what is ok, failed, stale or missing, and say why. References are listed mesh by mesh."""
    chosen = [find_study(study)] if study else list(STUDIES)
    if smoke:
        chosen, results = [entry.smoke() for entry in chosen], results / SMOKE
    ledger = Ledger(results, check)
    for entry in chosen:
        with busy(f"checking {entry.name}"):
            found = standings(ledger, entry)
        say(f"{entry.name}: {summary(found)}")
        if study:
            show_reasons(found, every)
            mixed = mixture(machines_of(found))
            if mixed:
                say(f"  {mixed}")
    show_references(ledger, {scene.name: scene for entry in chosen for scene in entry.scenes}.values(), every)


def show_reasons(found: list[Standing], every: bool) -> None:
    """What is not ok: each reason once, and under it the cases and reference solutions."""
    reasons: dict[tuple[str, str], list[str]] = {}
    for standing in found:
        if standing.status != "ok":
            reasons.setdefault((standing.status, standing.message), []).append(standing.job.label)
    for (word, message), labels in reasons.items():
        say(f"  {word}: {message}")
        shown = labels if every or len(labels) <= SHOWN + 1 else labels[:SHOWN]
        for label in shown:
            say(f"    {label}")
        if len(shown) < len(labels):
            say(f"    and {len(labels) - len(shown)} more (--all names them)")


def show_references(ledger: Ledger, scenes: Iterable[Scene], every: bool) -> None:
    """How the references stand: a line per scene, or one per mesh and setting."""
    found = {scene.name: [solve_standing(ledger, solve) for solve in reference_solves(scene)] for scene in scenes}
    found = {name: rows for name, rows in found.items() if rows}
    if not found:
        return
    say("references:")
    console.print(_meshes(found) if every else _scenes(found))


def _scenes(found: dict[str, list[SolveStanding]]) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in ("scene", "finest mesh", "unknowns", "seconds", "solutions"):
        table.add_column(heading, justify="left" if heading in ("scene", "solutions") else "right")
    for name, rows in found.items():
        finest = max(rows, key=lambda row: row.reference_solve.weight)
        seconds = sum(row.seconds for row in rows if row.seconds == row.seconds)
        state = status_counts(_state(row) for row in rows)
        table.add_row(name, f"{finest.reference_solve.level:g}", _count(finest.unknowns), f"{seconds:.0f}", state)
    return table


def _meshes(found: dict[str, list[SolveStanding]]) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in ("scene", "mesh", "better", "unknowns", "seconds", "state"):
        table.add_column(heading, justify="left" if heading in ("scene", "better", "state") else "right")
    for name, rows in found.items():
        for row in rows:
            seconds = "-" if row.seconds != row.seconds else f"{row.seconds:.1f}"
            cells = (f"{row.reference_solve.level:g}", row.reference_solve.variant, _count(row.unknowns), seconds)
            table.add_row(name, *cells, _state(row))
    return table


def _state(row: SolveStanding) -> str:
    if row.state != "half-way":
        return row.state
    return f"half-way ({row.steps} of {len(row.reference_solve.scene.checkpoints)} checkpoints)"


def _count(unknowns: int | None) -> str:
    return "-" if unknowns is None else f"{unknowns:,}"
