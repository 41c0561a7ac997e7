"""`organbench publish`: what the repository shows becomes what is stored."""

from pathlib import Path
from typing import Annotated

import typer

from studies.catalog import STUDIES
from studies.catalog.population import POPULATION
from studies.cli.terminal import Results, say
from studies.report import publish as publishing
from studies.report.published_code import CURRENT
from studies.sweep.find_study import find_study


def publish(
    studies: Annotated[
        list[str] | None,
        typer.Argument(metavar="STUDY", help="only these studies, also of a FILE.py, or results such as league"),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="only say what other code made, and which pages show something else")
    ] = False,
    results: Results = Path("results"),
) -> None:
    """Copy tables and charts to results/published, and summaries into README and docs. Stale results are refused."""
    if check:
        check_published(studies or [])
        return
    if studies:
        extras = [name for name in studies if name in publishing.EXTRAS]
        chosen = [find_study(name) for name in studies if name not in extras]
        copies, absent = publishing.publish_some(results, chosen, Path("."), extras), []
    else:
        copies, absent = publishing.publish(results, STUDIES, Path("."))
    for path in copies:
        say(path)
    if absent:
        again = "; ".join(f"{name}: {publishing.EXTRAS[name].command}" for name in absent)
        say(f"kept as published: {again}")


def check_published(names: list[str]) -> None:
    """Says of all that is published, or of these names and what lies in their folders, whether the present code would
    make it. Exit code 1: something is not current."""
    findings = publishing.check(Path("."), [*STUDIES, find_study(POPULATION)])
    shown = [one for one in findings if not names or one.name in names or one.name.split("/")[0] in names]
    for one in shown:
        say(f"{one.name}: {one.status}" + (f", {one.words}" if one.words else ""))
    behind = [one for one in shown if one.status != CURRENT]
    say(f"{len(shown) - len(behind)} of {len(shown)} are current")
    if behind:
        raise typer.Exit(1)
