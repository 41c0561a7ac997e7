"""`organbench export`: a scene for another program."""

from pathlib import Path
from typing import Annotated

import typer

from studies.cli.terminal import busy, say, warn
from studies.exchange.export import export as exported
from studies.exchange.meshes import NODES
from studies.sweep.find_scene import find_scene


def export(
    scene: Annotated[str, typer.Argument(help="a scene (see `organbench list`), or a FILE.py that defines SCENE")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="a folder; SCENE without")] = None,
    nodes: Annotated[int, typer.Option(help="vertices on the outer surface")] = NODES,
) -> None:
    """Writes a scene for another program: meshes, material, loads, checkpoints, and how to hand results in."""
    found = find_scene(scene)
    folder = output if output is not None else Path(found.name)
    with busy(f"meshing for {found.name}"):
        written, why_not = exported(found, folder, nodes)
    if why_not:
        warn([f"there is no curved mesh: {why_not}"])
    for path in written:
        say(path)
