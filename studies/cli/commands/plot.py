"""`organbench plot`: a study's charts and table, drawn from what is stored."""

from pathlib import Path

from studies.cli.terminal import Results, StudyName, say, warn
from studies.metrics.table import check_columns
from studies.report.results import refresh
from studies.store.ledger import Ledger
from studies.sweep.find_study import find_study


def plot(study: StudyName, results: Results = Path("results")) -> None:
    """Draw the charts and the table of a study. Nothing runs; the files are named."""
    found = find_study(study)
    check_columns(found.columns)
    paths, remarks = refresh(Ledger(results), found)
    warn(remarks)
    for path in paths:
        say(path)
