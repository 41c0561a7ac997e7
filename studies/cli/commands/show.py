"""`organbench show`: what is done, what is not, and why; or what is in a results file."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.cli.record_text import describe
from studies.cli.terminal import PROGRAM, SMOKE, Results, Smoke, busy, console, say, studies
from studies.metrics.table import check_columns
from studies.scene.scene import Scene
from studies.store.ledger import Ledger
from studies.store.paths import SUFFIX, study_folder
from studies.sweep.find_study import find_study
from studies.sweep.job import reference_jobs
from studies.sweep.standings import Standing, machines_of, mixture, standing_of, standings, summary

WHAT = f"a study or a FILE.py, with its problems ({PROGRAM}), or a results file; default: all studies, in numbers"
SHOWN = 8
"""Cases and reference solutions named per reason; `--all` names the rest."""


def show(
    what: Annotated[str, typer.Argument(metavar="STUDY|RESULT.h5", help=WHAT, autocompletion=studies)] = "",
    results: Results = Path("results"),
    smoke: Smoke = False,
    every: Annotated[
        bool, typer.Option("--all", help="name every case; of a results file also the meaning of each field")
    ] = False,
) -> None:
    """Show what is ok, failed, stale or missing, and why, or the numbers in a results file."""
    if what.endswith(SUFFIX):
        console.print(describe(Path(what), every), soft_wrap=False)  # long lines go on below
        return
    chosen, root = [find_study(what)] if what else [*STUDIES], results / SMOKE if smoke else results
    for study in chosen:
        if study.word:  # those of the catalogue are tested
            check_columns(study.columns)
            study_folder(root, study.name)  # raises for what names no folder
    if not results.is_dir():
        raise StudyError(f"there is no folder {results}: run `organbench run` first, or name the folder by --results")
    chosen, ledger = [study.smoke() if smoke else study for study in chosen], Ledger(root)
    for study in chosen:
        with busy(f"checking {study.name}"):
            found = standings(ledger, study)
        say(f"{study.name}: {summary(found)}")
        if what:
            show_reasons(found, every)
            if mixed := mixture(machines_of(found)):
                say(f"  {mixed}")
    show_references(ledger, {scene.name: scene for study in chosen for scene in study.scenes}.values())


def show_reasons(found: list[Standing], every: bool) -> None:
    """Each reason once, and under it the cases and reference solutions; what is ok only if `every`."""
    reasons: dict[str, list[str]] = {}
    for standing in found:
        if every or standing.status != "ok":
            reason = f"{standing.status}: {standing.message}" if standing.message else standing.status
            reasons.setdefault(reason, []).append(standing.job.label)
    for reason, labels in reasons.items():
        say(f"  {reason}")
        shown = labels if every or len(labels) <= SHOWN + 1 else labels[:SHOWN]
        for label in shown:
            say(f"    {label}")
        if len(shown) < len(labels):
            say(f"    and {len(labels) - len(shown)} more (--all names them)")


def show_references(ledger: Ledger, scenes: Iterable[Scene]) -> None:
    jobs = reference_jobs(ledger.root, scenes)
    if not jobs:
        return
    table = Table(box=None, pad_edge=False)
    for heading in ("scene", "unknowns", "seconds", "state"):
        table.add_column(heading, justify="left" if heading in ("scene", "state") else "right")
    found = [standing_of(ledger, job) for job in jobs]
    for standing in found:
        entry = standing.entry
        seconds = "-" if entry is None or entry.seconds is None else f"{entry.seconds:.0f}"
        unknowns = "-" if entry is None or entry.unknowns is None else f"{entry.unknowns:,}"
        table.add_row(standing.job.work.name, unknowns, seconds, standing.status)
    say("references:")
    console.print(table)
    for warning in dict.fromkeys(one.entry.warnings for one in found if one.entry is not None and one.entry.warnings):
        say(f"  {warning}")
