"""`organbench plot`: a study's charts and table, drawn from what is stored."""

from pathlib import Path

from studies.base.errors import StudyError
from studies.cli.terminal import Results, StudyName, say, warn
from studies.exchange.entry import entry_files
from studies.metrics.table import check_columns
from studies.report.results import refresh
from studies.runs.current import case_path
from studies.store.ledger import Ledger
from studies.sweep.find_study import find_study


def plot(study: StudyName, results: Results = Path("results")) -> None:
    """Draw the charts and the table of a study. Nothing runs; the files are named."""
    chosen_study = find_study(study)
    check_columns(chosen_study.columns)
    own = any(case_path(results, chosen_study.name, case).is_file() for case in chosen_study.cases)
    if not own and not entry_files(results):
        raise StudyError(f"nothing of {study} is stored in {results}; run `organbench run {study}` first")
    paths, remarks = refresh(Ledger(results), chosen_study)
    warn(remarks)
    for path in paths:
        say(path)
