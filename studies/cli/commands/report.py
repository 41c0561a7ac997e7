"""`organbench report`: everything that is looked at."""

from pathlib import Path
from typing import Annotated

import typer

from studies.catalog import STUDIES
from studies.cli.terminal import Results, say, warn
from studies.report import results as reports
from studies.store.ledger import Ledger
from studies.sweep.find_study import find_study


def report(
    studies: Annotated[
        list[str] | None, typer.Argument(metavar="STUDY", help="more studies, such as a FILE.py")
    ] = None,
    results: Results = Path("results"),
    figures: Annotated[bool, typer.Option(help="also draw the organs and the squeezed ball")] = False,
) -> None:
    """Draw all charts and tables and write report.html. The files are named."""
    more = [study for study in map(find_study, studies or []) if study not in STUDIES]
    written, remarks = reports.report(Ledger(results), [*STUDIES, *more])
    if figures:
        written += reports.draw_figures(results)
    warn(remarks)
    for path in written:
        say(path)
