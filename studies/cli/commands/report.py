"""`organbench report`: charts, tables, and the page that shows them all."""

from pathlib import Path
from typing import Annotated

import typer

from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.cli import terminal
from studies.cli.terminal import PROGRAM, Results, busy, say, warn
from studies.exchange.entry import entry_files
from studies.metrics.table import check_columns
from studies.report import results as reports
from studies.report.page.write import NAME
from studies.runs.current import case_path
from studies.store.ledger import Ledger
from studies.sweep.find_study import find_study

GIVEN = f"draw only these, of a FILE.py too ({PROGRAM}); default: all that are stored"


def report(
    studies: Annotated[
        list[str] | None, typer.Argument(metavar="STUDY", help=GIVEN, autocompletion=terminal.studies)
    ] = None,
    results: Results = Path("results"),
    figures: Annotated[bool, typer.Option(help="also draw the organs and the figures of the paper")] = False,
) -> None:
    """Draw charts and tables from what is stored and write report.html, which shows all studies. Nothing runs."""
    named = {name: find_study(name) for name in studies or []}
    for name, study in named.items():
        check_columns(study.columns)
        own = any(case_path(results, study.name, case).is_file() for case in study.cases)
        if not own and not entry_files(results):
            raise StudyError(f"nothing of {name} is stored in {results}; run `organbench run {name}` first")
    more = [study for study in named.values() if study not in STUDIES]
    with busy("drawing charts, tables and the page"):
        written, remarks = reports.report(Ledger(results), [*STUDIES, *more], [*named.values()] or None)
    if figures:
        written += reports.draw_figures(results)
    if not any(path.name == NAME for path in written):
        empty = f"nothing is stored in {results}, so there is no page; run `organbench run volume_loss` first"
        raise StudyError("; ".join([empty, *remarks]))
    warn(remarks)
    for path in written:
        say(path)
