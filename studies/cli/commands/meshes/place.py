"""`organbench place`: from a scan to a scene, by rule."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.cli.mesh_files import LongestSide, Part, Scale, Unit, Yes, settled, source_of, working
from studies.cli.terminal import say
from studies.geometry import scan
from studies.plots.place import draw_placing
from studies.scene.proposal import Proposal, proposal
from studies.scene.scene_file import RADIUS, scene_text

MM = 1e-3
NODES = 550


def place(
    path: Annotated[Path, typer.Argument(help="a surface: STL, OBJ, PLY, VTK, glTF, a label mask …")],
    output: Annotated[Path, typer.Option("-o", "--output", help="the scene file that is written")] = Path("scene.py"),
    picture: Annotated[Path | None, typer.Option(help="a PNG of hold and probe")] = None,
    nodes: Annotated[int, typer.Option(help="of the outer surface")] = NODES,
    smooth: Annotated[float, typer.Option(help="close folds, level bumps of so many millimetres")] = 0.0,
    unit: Unit = None,
    scale: Scale = 1.0,
    longest_side: LongestSide = None,
    part: Part = None,
    yes: Yes = False,
) -> None:
    """Proposes hold and probe for a scan by rule, and writes a scene file."""
    if output.suffix != ".py":
        raise StudyError(f"{output.name}: a scene file is Python; give it a name that ends in .py")
    if picture is not None and picture.suffix.lower() != ".png":
        raise StudyError(f"{picture.name}: the picture is a PNG; give it a name that ends in .png")
    source = settled(source_of(path, unit, scale, longest_side, part), yes)
    with working(f"meshing {path.name}"):
        mesh = scan(source, nodes, smooth=smooth * MM, fill=False)
    if source.longest_side is None:
        source = replace(source, unit=mesh.recipe["unit"])  # a scene says it, also where the file does
    found = proposal(mesh)
    for line in lines_of(found):
        say(line)
    options: dict[str, object] = {"smooth": smooth * MM} if smooth else {}
    write_whole(output, scene_text(found, source, options, nodes, output.parent).encode())
    if picture is not None:
        draw_placing(mesh, found, RADIUS * found.sides[0], picture)
    say(f"written to {output}; next: organbench run {output}")


def lines_of(found: Proposal) -> list[str]:
    """The proposal for a person."""

    def mm(values: tuple[float, ...]) -> str:
        return ", ".join(f"{1e3 * x:.4g}" for x in values)

    axes = "; ".join(", ".join(f"{x:.2f}" for x in axis) for axis in found.axes)
    return [
        f"extents along the principal axes: {mm(found.sides)} mm (axes {axes}; middle {mm(found.middle)} mm)",
        f"hold: the blunter end, {100 * found.held_share:.0f} % of the surface, beyond ({mm(found.hold.point)}) mm",
        f"palpate: ({mm(found.palpation.point)}) mm, the flattest free patch far from the hold "
        f"(flatness {found.flatness:.2f}; 1 is a plane)",
    ]
