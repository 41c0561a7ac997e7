"""`organbench advise`: which recipe is good enough for a scene."""

from pathlib import Path
from typing import Annotated

import typer

from studies.base.compile_watch import watching
from studies.cli.options import budget as in_time
from studies.cli.options import share
from studies.cli.progress import compiling
from studies.cli.terminal import Results, SceneName, say
from studies.sweep.find_scene import find_scene
from studies.tools.advise.answer import advise as answered
from studies.tools.advise.words import lines_of


def advise(
    scene: SceneName,
    force: Annotated[str, typer.Option(help="largest error of the final force: 3% or 0.03")] = "",
    displacement: Annotated[
        str, typer.Option(help="largest mean surface error relative to the largest displacement: 1% or 0.01")
    ] = "",
    budget: Annotated[str, typer.Option(help="largest computing time per 1 ms of simulated time: 1ms or 250us")] = "",
    timing: Annotated[bool, typer.Option(help="measure the recommended body if no timing is stored")] = True,
    results: Results = Path("results"),
) -> None:
    """Recommend the cheapest accurate body for a scene, with its measured errors and its cost.

    Without --force and --displacement: force within 3 %, displacement within 1 %; hollow organs 6 % and 3 %.
    Exit code 1: no body is known to meet that.
    """
    bounds = share(force, "force"), share(displacement, "displacement"), in_time(budget)
    with compiling("timing") as report, watching(report):
        advice = answered(find_scene(scene), *bounds, results=results, timing=timing)
    for line in lines_of(advice):
        say(line)
    if not advice.meets:
        raise typer.Exit(1)
