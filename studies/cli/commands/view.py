"""`organbench view`: stored cases with their reference in one file for ParaView."""

from pathlib import Path
from typing import Annotated

import typer

from studies.base.counting import counted
from studies.cli.terminal import Results, busy, say, warn
from studies.report.view.side_by_side import side_by_side
from studies.report.view.stored import listing
from studies.report.view.viewing import view as viewed
from studies.report.view.vtkhdf import SUFFIX, check_target, write_grid
from studies.sweep.find_scene import find_scene, split_word


def view(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="SCENE|CASE", help="a scene or a FILE.py for all its cases, or a results file"),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help=f"{SUFFIX} file  \\[default: SCENE{SUFFIX}]")
    ] = None,
    results: Results = Path("results"),
) -> None:
    """Write cases and their reference to a file for ParaView. Without an argument: list the cases."""
    if not names:
        lines, remarks = listing(results)
        warn(remarks)
        for line in lines:
            say(line)
        return
    if output is not None:
        check_target(output)
    own = {name: find_scene(name) for name in names if split_word(name)[0]}
    with busy(f"reading {' '.join(names)}"):
        scene_view = viewed(results, [own[name].name if name in own else name for name in names], list(own.values()))
    warn(scene_view.remarks)
    path = output if output is not None else Path(scene_view.scene.name + SUFFIX)
    size = write_grid(path, side_by_side(scene_view.times, scene_view.bodies))
    times = " ".join(f"{t:g}" for t in scene_view.times)
    say(f"{path}: {counted(len(scene_view.bodies), 'body', 'bodies')} at {times} s, {size / 1e6:.1f} MB")
    for number, body in enumerate(scene_view.bodies):
        say(f"  {number}  {body.name}")
