"""`organbench place`: from a scan to a scene, by rule."""

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog.folder import placed_scene
from studies.cli.mesh_files import MM, LongestSide, Part, Scale, Unit, Yes, in_metres, settled, source_of
from studies.cli.terminal import busy, say, warn
from studies.geometry import BallRegion, scan
from studies.geometry.files.units import stem_of
from studies.meshing.bounds import SHAPE, SHAPE_VOLUME, enough
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.meshing.rest_surface import rest_surfaces
from studies.meshing.true_surface import ShapeErrors, shape_errors, true_surface
from studies.plots.place import draw_placing
from studies.runs.case import Case
from studies.runs.prepare import mesh_of
from studies.scene.chosen_place import RADIUS, SIDES, place_of
from studies.scene.proposal import Proposal, proposal
from studies.scene.scene import Organ, ReferencePlan, Scene
from studies.scene.scene_file import Recommended, organ_options, python_name, scene_text
from studies.scene.tissues import TISSUES, tissue_named
from studies.sweep.estimate import SECONDS_PER_UNKNOWN
from studies.tools.advise.campaign import shipped
from studies.tools.advise.population import Unseen, supported
from studies.tools.advise.words import body_in_python

NODES = 550
FINER, TRIES = 1.5, 3
"""Ratio of the numbers of nodes of successive bodies, and how many are tried, until one keeps the shape."""
THIN = ReferencePlan(base=1000, most=120e3)
"""Where thin margins ask for a finer body than random organs do: from 270 surface nodes on, the reference of a real
liver stays 2.5 % of its size off the surface, its force known to 2.9 %; from 1,000 on .27 and .9 %, in
3.5 times the time."""
GROWTH = 1.6
"""Computing time of an adaptive body over a power of its nodes: 2.6, 1.86, 1.22 s/s with 994, 1,194, 1,594."""
MESHING = 60.0
"""Seconds for the meshes of the same spleen and liver: 26 and 51, and those of the bodies."""
SIDES_HELP = f"{', '.join(SIDES)} of the patient (+x is left, +y back, +z top; of a mask as its header says)"


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
    with busy(f"meshing {path.name}"):
        mesh = scan(source, nodes, fill=False, **how)
    if source.longest_side is None:
        source = replace(source, unit=mesh.recipe["unit"])  # a scene says it, also where the file does
    placing = proposal(mesh, held, probed)
    by_name = ", as the file is called; --tissue names another" if tissue is None else ""
    say(f"tissue: {name}, shear modulus {1e-3 * TISSUES[name].shear_modulus:g} kPa{by_name}")
    say(f"  source: {TISSUES[name].source}")
    for line in lines_of(placing):
        say(line)
    organ = Organ("file", organ_options(source, how))
    scene = placed_scene(python_name(stem_of(path)), organ, placing, TISSUES[name], 6.0, 5, 240)  # as in the file
    body, plan, seconds, found = None, ReferencePlan(), MESHING, supported(shipped(), scene, name)
    if found is None:
        warn(["the scene has only one body, because no random organs are published, by which to recommend one"])
    else:
        (case, sample), most = found, found[0].body.nodes
        body, most = recommended(scene, case, sample)
        plan = THIN if most > case.body.nodes else plan
        seconds += 2.0 * sample.cost * scene.duration * (most / case.body.nodes) ** GROWTH  # the run, and its timing
    seconds += SECONDS_PER_UNKNOWN * plan.most  # on one core, roughly, and without compiling
    thin = f"ReferencePlan(base={THIN.base}, most={THIN.most:g})"  # as short as a user would write it
    reference = thin if plan == THIN else "ReferencePlan()"
    text = scene_text(placing, organ_options(source, how), name, nodes, body, output.parent, reference)
    write_whole(output, text.encode())
    if picture is not None:
        draw_placing(mesh, placing, RADIUS * placing.sides[0], picture)
    say(f"written to {output}; next: organbench run {output}, which takes about {seconds / 60.0:.0f} minutes")


def recommended(scene: Scene, case: Case, sample: Unseen) -> tuple[Recommended, int]:
    """The body of a case or, where that does not keep the shape of this organ, the first of larger ones that does, or
    else the nearest; and its nodes. Says what it found. Raises StudyError if none can be made."""
    tried, refusals, nodes = list[tuple[ShapeErrors, int]](), list[StudyError](), case.body.nodes
    for _ in range(TRIES):
        try:
            with busy(f"the shape of a body of {nodes:,} nodes"), warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # `run` repeats those of the body
                mesh = mesh_of(scene, replace(case.body, nodes=nodes))
                facets = mesh.facets if isinstance(mesh, QuadraticMesh) else mesh.triangles
                tried.append((shape_errors(scene.organ, rest_surfaces(mesh.points, facets), filled=True), nodes))
            if tried[-1][0].worst <= 1.0:
                break
        except StudyError as error:  # a larger mesh may be possible
            refusals.append(error)
        nodes = 10 * round(FINER * nodes / 10)
    if not tried:
        raise refusals[0]
    errors, nodes = min(tried, key=lambda pair: pair[0].worst)
    body, keeps = replace(case.body, nodes=nodes), errors.worst <= 1.0
    shape = f"with {nodes:,} nodes it is {errors} (allowed: {SHAPE:g} and {SHAPE_VOLUME:g} %)"
    words, most = "recommended" if keeps else "the nearest; none keeps the shape", max(tried, key=lambda pair: pair[1])
    if not keeps:
        shape += f", about {enough(most[1], most[0].worst):,} nodes would do"
    say(f"bodies: {body.series}, {nodes:,} nodes ({words}); tetrahedral of one volume")
    say(f"  {sample.promise}{'' if nodes == case.body.nodes else f', with {case.body.nodes:,} nodes'}")
    say(f"  shape of this organ: {shape}")
    truth = true_surface(scene.organ)
    if truth is not None:
        volume = 1e6 * sum(truth.volumes.values())
        body_volume = f"{volume * (1.0 + errors.volume):.5g} mL ({100.0 * errors.volume:+.3f} %)"
        say(f"  volume: file {volume:.5g} mL, body {body_volume}")
    if not keeps:
        warn([f"part of the shape is missing: {shape}; smooth thin margins (--smooth 3), or do not rely on it there"])
    return Recommended(body_in_python(body), case.dt_fraction, sample.promise, shape, keeps), nodes


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
