"""`organbench restamp`: keeps results after a change of the code that changes no number."""

from pathlib import Path
from typing import Annotated

import typer

from studies.cli.progress import words
from studies.cli.terminal import PROGRAM, Results, say
from studies.sweep.find_study import find_studies
from studies.sweep.restamp import outdated, sample
from studies.sweep.restamp import restamp as restamp_kind


def restamp(
    studies: Annotated[
        list[str] | None, typer.Argument(metavar="STUDY", help=f"studies, default: the main ones ({PROGRAM})")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="replay every result, not a sample")] = False,
    dry: Annotated[bool, typer.Option("--dry-run", help="only print what would be replayed")] = False,
    results: Results = Path("results"),
) -> None:
    """Keep results after a change of code that moves no number. Replays of a sample show that none does.

    Of each study, and of the references of its scenes, the quickest result of each method and kind of body is
    replayed, and three at random. Where all come out the same, bit for bit, the others count as results of the present
    code, and say so ("restamped"). One difference, and none of them does (exit code 1).

    A sample is evidence, not proof: --all replays everything. Words of messages and warnings stay the old ones. Frame
    times are kept with their case and not measured again: `organbench run --again timing` does that. What failed, did
    not converge or took too long stays stale."""
    kinds = outdated(results, find_studies(studies or []))
    if not kinds:
        say("no result is stale only because the code changed")
    differ = False
    for members in kinds:
        replayed = members if every else sample(members)
        name, former, _ = members[0].kind
        seconds = words(sum(one.seconds for one in replayed))
        say(f"{name}: {len(members)} results of code {former[:8]}, {len(replayed)} to replay, about {seconds}")
        if dry:
            continue
        changed = restamp_kind(members, replayed, lambda label: say(f"  {label}: the same"))
        differ |= changed is not None
        say(f"{name}: {f'not restamped: {changed}' if changed else f'{len(members)} results restamped'}")
    if differ:
        raise typer.Exit(1)
