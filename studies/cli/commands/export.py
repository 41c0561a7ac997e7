"""`organbench export`: a scene for another program."""

from pathlib import Path
from typing import Annotated

import typer

from studies.base.errors import StudyError
from studies.cli.terminal import Results, SceneName, busy, say, warn
from studies.exchange.export import export as exported
from studies.exchange.meshes import NODES
from studies.exchange.starter import NAME
from studies.sweep.find_scene import find_scene
from studies.tools.advise.yardsticks import yardsticks


def export(
    scene: SceneName,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="folder to write  \\[default: the name of the scene]")
    ] = None,
    nodes: Annotated[int, typer.Option(help="vertices on the outer surface")] = NODES,
    results: Results = Path("results"),
) -> None:
    """Write a scene for another program: meshes, material, loads, output times, and how to hand results in.

    README.md in the folder holds what our own bodies reach.
    """
    chosen_scene = find_scene(scene)
    folder = output if output is not None else Path(chosen_scene.name)
    try:
        rows = yardsticks(results, chosen_scene)
    except StudyError as problem:
        warn([f"README.md names no measured body: {problem}"])
        rows = []
    with busy(f"meshing for {chosen_scene.name}"):
        written, why_not = exported(chosen_scene, folder, nodes, rows)
    if why_not:
        warn([f"there is no curved mesh: {why_not}"])
    for path in written:
        say(path)
    if folder / NAME not in written:
        say(f"{folder / NAME} was edited and stays as it is")
