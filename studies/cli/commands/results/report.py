"""`organbench report`: everything that is looked at."""

from pathlib import Path
from typing import Annotated

import typer

from studies.catalog import STUDIES
from studies.cli.terminal import Results, say, warn
from studies.report import results as reports


def report(
    results: Results = Path("results"),
    figures: Annotated[bool, typer.Option(help="also the pictures of organs and of the squeezed ball")] = False,
) -> None:
    """All charts and tables, and the summaries; names what it wrote."""
    written, remarks = reports.report(results, STUDIES)
    if figures:
        written += reports.draw_figures(results)
    warn(remarks)
    for path in written:
        say(path)
