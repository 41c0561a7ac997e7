"""`organbench fuzz`: random trials that try to break every method, and what came of each."""

import gzip
from pathlib import Path
from typing import Annotated

import typer

from studies.base.atomic import write_whole
from studies.cli.progress import TerminalProgress
from studies.cli.terminal import Results, console, errors, say
from studies.plots.campaigns.breaking import draw as draw_chart
from studies.store.tables import write_table
from studies.tools.fuzz.outcome import UNEXPLAINED, Outcome, counts, run_trials, table_of, tried
from studies.tools.fuzz.trial import draw

FOLDER, WHAT = "breaking", "trials"


def fuzz(
    cases: Annotated[int, typer.Option(min=1, help="number of trials")] = 1000,
    seed: Annotated[int, typer.Option(min=0, help="seed of the random trials")] = 0,
    trial: Annotated[int | None, typer.Option(min=0, help="repeat this trial alone")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="processes")] = 2,
    results: Results = Path("results"),
) -> None:
    """Try to break every method with random trials of bodies and surroundings. Exit code 1: an unclassified failure."""
    if trial is not None:
        outcomes = [tried(draw(seed, trial))]
        tell(outcomes[0])
        say(str(outcomes[0].trial))
    else:
        with TerminalProgress(errors) as progress:
            progress.begin(WHAT, cases)
            trials = [draw(seed, number) for number in range(cases)]
            outcomes = run_trials(trials, jobs, lambda outcome: progress.advance(WHAT, outcome.status))
        table, folder = table_of(outcomes), results / FOLDER
        draw_chart(table, folder / "breaking.png")
        counted = counts(table).reset_index()
        say(write_table(folder / "counts.csv", counted))
        write_whole(folder / "trials.csv.gz", gzip.compress(table.to_csv(index=False).encode(), mtime=0))
        console.print(counted.to_string(index=False), markup=False, highlight=False)
        for outcome in outcomes:
            if outcome.status == UNEXPLAINED:
                tell(outcome)
    if any(outcome.status == UNEXPLAINED for outcome in outcomes):
        raise typer.Exit(1)


def tell(outcome: Outcome) -> None:
    say(f"{outcome.status}: {outcome.message or 'no fault'} ({outcome.seconds:.2g} s): {outcome.trial.line}")
