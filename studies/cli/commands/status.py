"""`organbench status`: what is done, what is not, and why."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.cli.terminal import SMOKE, Results, Smoke, busy, console, say
from studies.scene.scene import Scene
from studies.store.ledger import Ledger
from studies.store.paths import study_folder
from studies.sweep.find_study import find_study
from studies.sweep.job import reference_jobs
from studies.sweep.standings import Standing, machines_of, mixture, standing_of, standings, summary

SHOWN = 8
"""Cases and reference solutions named per reason; `--all` names the rest."""


def status(
    study: Annotated[str, typer.Argument(help="a study, with its problems; default: all studies, in numbers")] = "",
    results: Results = Path("results"),
    smoke: Smoke = False,
    every: Annotated[bool, typer.Option("--all", help="name every problem")] = False,
    check: Annotated[bool, typer.Option(help="verify the checksums of all files, not only changed ones")] = False,
) -> None:
    """Count what is ok, failed, stale or missing, and say why."""
    chosen, root = [find_study(study)] if study else list(STUDIES), results
    if smoke:
        chosen, results = [entry.smoke() for entry in chosen], results / SMOKE
    own = [entry for entry in chosen if entry.word]  # those of the catalogue are tested
    if own:
        from studies.metrics.table import check_columns  # with the solvers, which take a while to load

        for entry in own:
            check_columns(entry.columns)
            study_folder(results, entry.name)  # raises for what names no folder
    if not root.is_dir():
        raise StudyError(f"there is no folder {root}: run `organbench run` first, or name the folder by --results")
    ledger = Ledger(results, check)
    for entry in chosen:
        with busy(f"checking {entry.name}"):
            job_standings = standings(ledger, entry)
        say(f"{entry.name}: {summary(job_standings)}")
        if study:
            show_reasons(job_standings, every)
            mixed = mixture(machines_of(job_standings))
            if mixed:
                say(f"  {mixed}")
    show_references(ledger, {scene.name: scene for entry in chosen for scene in entry.scenes}.values())


def show_reasons(job_standings: list[Standing], every: bool) -> None:
    """Results that are not ok: each reason once, and under it the cases and reference solutions."""
    reasons: dict[tuple[str, str], list[str]] = {}
    for standing in job_standings:
        if standing.status != "ok":
            reasons.setdefault((standing.status, standing.message), []).append(standing.job.label)
    for (word, message), labels in reasons.items():
        say(f"  {word}: {message}")
        shown = labels if every or len(labels) <= SHOWN + 1 else labels[:SHOWN]
        for label in shown:
            say(f"    {label}")
        if len(shown) < len(labels):
            say(f"    and {len(labels) - len(shown)} more (--all names them)")


def show_references(ledger: Ledger, scenes: Iterable[Scene]) -> None:
    """How the references stand, a line per scene."""
    jobs = reference_jobs(ledger.root, scenes)
    if not jobs:
        return
    table = Table(box=None, pad_edge=False)
    for heading in ("scene", "unknowns", "seconds", "state"):
        table.add_column(heading, justify="left" if heading in ("scene", "state") else "right")
    for standing in (standing_of(ledger, job) for job in jobs):
        entry = standing.entry
        seconds = "-" if entry is None or entry.seconds is None else f"{entry.seconds:.0f}"
        table.add_row(standing.job.work.name, _count(entry and entry.unknowns), seconds, standing.status)
    say("references:")
    console.print(table)


def _count(unknowns: int | None) -> str:
    return "-" if unknowns is None else f"{unknowns:,}"
