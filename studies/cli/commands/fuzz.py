"""`organbench fuzz`: random trials that try to break every method, the reference or cuts, and what came of each."""

import gzip
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.cli.progress import TerminalProgress
from studies.cli.terminal import Results, console, errors, say
from studies.plots.campaigns.breaking import draw as draw_chart
from studies.store.tables import write_table
from studies.tools.fuzz.campaign import counts, run_trials, table_of
from studies.tools.fuzz.cuts import CutTrial
from studies.tools.fuzz.cuts import draw as draw_cut
from studies.tools.fuzz.cuts import tried as try_cut
from studies.tools.fuzz.outcome import UNEXPLAINED, Attempt, Outcome, simplest, tried
from studies.tools.fuzz.reference.outcome import tried as try_reference
from studies.tools.fuzz.reference.table import counts_by_choice, last_states
from studies.tools.fuzz.reference.trial import draw as draw_reference
from studies.tools.fuzz.trial import draw

FOLDER, REFERENCE, CUTS, TRIALS, LAST = "breaking", "breaking_reference", "breaking_cuts", "trials.csv.gz", "last.npz"
WHAT = "trials"
CAMPAIGNS: Mapping[str, tuple[Callable[[int, int], Any], Attempt]] = {
    FOLDER: (draw, tried),
    REFERENCE: (draw_reference, try_reference),
    CUTS: (draw_cut, try_cut),
}
"""How each campaign draws and runs a trial, by the folder of its results."""


def fuzz(
    cases: Annotated[int, typer.Option(min=1, help="number of trials")] = 1000,
    seed: Annotated[int, typer.Option(min=0, help="seed of the random trials")] = 0,
    trial: Annotated[int | None, typer.Option(min=0, help="repeat this trial and simplify it")] = None,
    reference: Annotated[bool, typer.Option("--reference", help="test the finite-element reference instead")] = False,
    cuts: Annotated[bool, typer.Option("--cuts", help="cut random organs instead")] = False,
    jobs: Annotated[int, typer.Option(min=1, help="processes")] = 2,
    results: Results = Path("results"),
) -> None:
    """Try to break every method with random trials of bodies and surroundings. Exit code 1: an unclassified failure."""
    if reference and cuts:
        raise StudyError("--reference and --cuts are two campaigns; give one of them")
    campaign = REFERENCE if reference else CUTS if cuts else FOLDER
    make, attempt = CAMPAIGNS[campaign]
    if trial is not None:
        outcomes = [attempt(make(seed, trial))]
        tell(outcomes[0])
        say(f"simplest: {simplest(outcomes[0], attempt=attempt).trial.changed}")
    else:
        with TerminalProgress(errors) as progress:
            progress.begin(WHAT, cases)
            trials = [make(seed, number) for number in range(cases)]
            outcomes = run_trials(trials, jobs, lambda outcome: progress.advance(WHAT, outcome.status), attempt)
        {FOLDER: store, REFERENCE: store_reference, CUTS: store_cuts}[campaign](results, outcomes)
        for outcome in outcomes:
            if outcome.status == UNEXPLAINED:
                tell(outcome)
    if any(outcome.status == UNEXPLAINED for outcome in outcomes):
        raise typer.Exit(1)


def store(results: Path, outcomes: Sequence[Outcome]) -> None:
    """The table, counts and chart of a campaign against the methods."""
    table = table_of(outcomes)
    draw_chart(table, results / FOLDER / "breaking.png")
    write(results, FOLDER, table, counts(table).reset_index())


def store_reference(results: Path, outcomes: Sequence[Outcome]) -> None:
    """The same against the reference, without a chart, and the last states that converged before a failure."""
    table = table_of(outcomes)
    write_whole(results / REFERENCE / LAST, last_states(outcomes))
    write(results, REFERENCE, table, counts_by_choice(table))


def store_cuts(results: Path, outcomes: Sequence[Outcome]) -> None:
    """The same of cuts, counted by kind."""
    kinds = [outcome.trial.kind for outcome in outcomes if isinstance(outcome.trial, CutTrial)]
    table = table_of(outcomes).assign(kind=kinds)
    write(results, CUTS, table, counts(table, "kind").reset_index())


def write(results: Path, folder: str, table: pd.DataFrame, counted: pd.DataFrame) -> None:
    """Counts and trials of a campaign, below `results`/`folder`."""
    say(write_table(results / folder / "counts.csv", counted))
    write_whole(results / folder / TRIALS, gzip.compress(table.to_csv(index=False).encode(), mtime=0))
    console.print(counted.to_string(index=False), markup=False, highlight=False)


def tell(outcome: Outcome) -> None:
    """How a trial ended, and the line that repeats it."""
    say(f"{outcome.status}: {outcome.message or 'no fault'} ({outcome.seconds:.2g} s): {outcome.trial.line}")
