"""`organbench place`: from a scan to a scene, by rule."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog.folder import placed_scene
from studies.cli.mesh_files import MM, LongestSide, Part, Scale, Unit, Yes, in_metres, settled, source_of, working
from studies.cli.terminal import say, warn
from studies.geometry import BallRegion, scan
from studies.geometry.files.units import stem_of
from studies.metrics.cells import value_cell
from studies.plots.place import draw_placing
from studies.scene.chosen_place import RADIUS, SIDES, place_of
from studies.scene.proposal import Proposal, proposal
from studies.scene.scene import ReferencePlan
from studies.scene.scene_file import Recommended, organ_options, python_name, scene_text
from studies.scene.tissues import TISSUES, tissue_named
from studies.sweep.estimate import SECONDS_PER_UNKNOWN
from studies.tools.advise.answer import Advice, advise
from studies.tools.advise.campaign import shipped
from studies.tools.advise.words import body_in_python

NODES = 550
MESHING = 60.0
"""Seconds for the meshes of the same spleen and liver: 26 and 51, and those of the bodies."""
SIDES_HELP = f"{', '.join(SIDES)} (left is -x, front -y, bottom -z)"


def place(
    path: Annotated[Path, typer.Argument(help="a surface: STL, OBJ, PLY, VTK, glTF, a label mask …")],
    output: Annotated[Path, typer.Option("-o", "--output", help="scene file to write")] = Path("scene.py"),
    picture: Annotated[Path | None, typer.Option(help="draw hold and probe to this PNG file")] = None,
    tissue: Annotated[str | None, typer.Option(help=f"{', '.join(TISSUES)}; default: by the file's name")] = None,
    hold: Annotated[str | None, typer.Option(help=f"{SIDES_HELP}, or x,y,z in mm; default: the blunter end")] = None,
    probe: Annotated[str | None, typer.Option(help="a side or x,y,z in mm; default: the flattest patch")] = None,
    nodes: Annotated[int, typer.Option(help="surface nodes of the body with one volume")] = NODES,
    smooth: Annotated[float, typer.Option(help="close folds and level bumps of this size in mm")] = 0.0,
    solid: Annotated[float | None, typer.Option(help="fill a shell, close openings up to this size in mm")] = None,
    wall: Annotated[float | None, typer.Option(help="wall thickness of a hollow organ in mm")] = None,
    close_holes: Annotated[bool, typer.Option("--close-holes", help="close holes with flat lids")] = False,
    unit: Unit = None,
    scale: Scale = 1.0,
    longest_side: LongestSide = None,
    part: Part = None,
    yes: Yes = False,
) -> None:
    """Place hold and probe on a scan and write a study: two bodies, their reference, charts and replays."""
    if output.suffix != ".py":
        raise StudyError(f"{output.name}: a scene file is Python; give it a name that ends in .py")
    if picture is not None and picture.suffix.lower() != ".png":
        raise StudyError(f"{picture.name}: the picture is a PNG; give it a name that ends in .png")
    held, probed = (None if text is None else place_of(text) for text in (hold, probe))
    if tissue is not None:
        lookup(tissue, TISSUES, "tissue")
    name = tissue or tissue_named(" ".join([stem_of(path), *([part] if part else [])]))
    source = settled(source_of(path, unit, scale, longest_side, part), yes)
    how: dict[str, Any] = {"smooth": smooth * MM, "holes": close_holes}
    how |= {"solid": in_metres(solid), "wall": in_metres(wall)}
    with working(f"meshing {path.name}"):
        mesh = scan(source, nodes, fill=False, **how)
    if source.longest_side is None:
        source = replace(source, unit=mesh.recipe["unit"])  # a scene says it, also where the file does
    placing = proposal(mesh, held, probed)
    by_name = ", as the file is called; --tissue names another" if tissue is None else ""
    say(f"tissue: {name}, shear modulus {1e-3 * TISSUES[name].shear_modulus:g} kPa{by_name}")
    say(f"  source: {TISSUES[name].source}")
    for line in lines_of(placing):
        say(line)
    scene = placed_scene(python_name(stem_of(path)), source, placing, TISSUES[name], how["wall"])
    body, seconds = None, MESHING
    try:
        answer = advise(scene, results=shipped(), timing=False)
    except StudyError as error:
        warn([f"the scene has only one body, because none can be recommended: {error}"])
    else:
        body = second_body(answer)
        if answer.chosen is not None and answer.chosen.cost.known:
            seconds += answer.chosen.cost.value * scene.duration
    seconds += SECONDS_PER_UNKNOWN * ReferencePlan().most  # on one core, roughly, and without compiling
    text = scene_text(placing, organ_options(source, how), name, nodes, body, output.parent)
    write_whole(output, text.encode())
    if picture is not None:
        draw_placing(mesh, placing, RADIUS * placing.sides[0], picture)
    say(f"written to {output}; next: organbench run {output}, which takes about {seconds / 60.0:.0f} minutes")


def second_body(answer: Advice) -> Recommended | None:
    if answer.chosen is None:
        return None
    case, force, displacement = answer.chosen.case, answer.chosen.force, answer.chosen.displacement
    errors = f"force {value_cell(force.value, force.uncertainty, signed=True)} %, "
    errors += f"displacement {value_cell(displacement.value, displacement.uncertainty)} %"
    near = "" if answer.meets else ", closest to the default target"
    alike = answer.alike or (answer.scene.name,)
    say(f"bodies: tetrahedral of one volume; {case.body.series}, {case.body.nodes} nodes (recommended{near})")
    say(f"  worst errors of the recommended one in {' and '.join(alike)}: {errors}")
    return Recommended(body_in_python(case.body), case.dt_fraction, alike, errors)


def lines_of(placing: Proposal) -> list[str]:
    def mm(values: tuple[float, ...]) -> str:
        return ", ".join(f"{1e3 * x:.4g}" for x in values)

    axes = "; ".join(", ".join(f"{x:.2f}" for x in axis) for axis in placing.axes)
    hold = placing.hold
    where = f"within {1e3 * hold.radius:.3g} mm of" if isinstance(hold, BallRegion) else "beyond"
    at = hold.center if isinstance(hold, BallRegion) else hold.point
    return [
        f"extents along the principal axes: {mm(placing.sides)} mm (axes {axes}; middle {mm(placing.middle)} mm)",
        f"hold: {placing.held_where}, {100 * placing.held_share:.0f} % of the surface, {where} ({mm(at)}) mm",
        f"palpate: ({mm(placing.palpation.point)}) mm, flatness {placing.flatness:.2f} (1 is a plane)",
    ]
