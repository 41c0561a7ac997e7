"""`organbench stress`: random trials that try to break every method, and what came of each."""

import gzip
from pathlib import Path
from typing import Annotated

import typer

from studies.base.atomic import write_whole
from studies.cli.progress import TerminalProgress
from studies.cli.terminal import Results, console, errors, say
from studies.plots.campaigns.breaking import draw as draw_chart
from studies.store.csv_table import write_table
from studies.store.stamps import set_stamp
from studies.stress.campaign import counts, drawn, run_trials, table_of
from studies.stress.outcome import UNEXPLAINED, Outcome, simplest, tried
from studies.stress.trial import draw

FOLDER, TRIALS = "breaking", "trials.csv.gz"
WHAT = "trials"


def stress(
    cases: Annotated[int, typer.Option(min=1, help="how many trials")] = 1000,
    seed: Annotated[int, typer.Option(min=0, help="another seed draws other trials")] = 0,
    trial: Annotated[int | None, typer.Option(min=0, help="this one alone, and the simplest that ends alike")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="processes")] = 2,
    results: Results = Path("results"),
) -> None:
    """Tries to break every method with random bodies and surroundings (exit code 1: an end without a name)."""
    if trial is not None:
        found = [tried(draw(seed, trial))]
        tell(found[0])
        say(f"simplest: {simplest(found[0]).trial.changed}")
    else:
        with TerminalProgress(errors) as progress:
            progress.begin(WHAT, cases)
            found = run_trials(drawn(seed, cases), jobs, lambda outcome: progress.advance(WHAT, outcome.status))
        table = table_of(found)
        say(write_table(results / FOLDER / "counts.csv", counts(table).reset_index()))
        write_whole(results / FOLDER / TRIALS, gzip.compress(table.to_csv(index=False).encode(), mtime=0))
        draw_chart(table, results / FOLDER / "breaking.png")
        set_stamp(results, FOLDER)
        console.print(counts(table).to_string(), markup=False, highlight=False)
        for outcome in found:
            if outcome.status == UNEXPLAINED:
                tell(outcome)
    if any(outcome.status == UNEXPLAINED for outcome in found):
        raise typer.Exit(1)


def tell(outcome: Outcome) -> None:
    """How a trial ended, and the line that repeats it."""
    say(
        f"{outcome.status}: {outcome.message or 'nothing to object to'} ({outcome.seconds:.2g} s): {outcome.trial.line}"
    )
