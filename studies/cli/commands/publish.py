"""`organbench publish`: what the repository shows becomes what is stored."""

from pathlib import Path
from typing import Annotated

import typer

from studies.catalog import STUDIES
from studies.cli.terminal import Results, say
from studies.report import publish as publishing
from studies.sweep.find_study import find_study


def publish(
    studies: Annotated[
        list[str] | None, typer.Argument(metavar="STUDY", help="publish only these studies, also from a FILE.py")
    ] = None,
    results: Results = Path("results"),
) -> None:
    """Copy tables and charts to results/published, and summaries into README and docs. Stale results are refused."""
    if studies:
        copies, absent = publishing.publish_some(results, [find_study(name) for name in studies], Path(".")), []
    else:
        copies, absent = publishing.publish(results, STUDIES, Path("."))
    for path in copies:
        say(path)
    if absent:
        again = "; ".join(f"{name}: {publishing.EXTRAS[name]}" for name in absent)
        say(f"kept as published: {again}")
