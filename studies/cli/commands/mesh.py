"""`organbench mesh`: from a name or a file to a mesh, and what is wrong with one."""

import json
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.cli import findings
from studies.cli.mesh_files import (
    MM,
    LongestSide,
    Part,
    Scale,
    Unit,
    Yes,
    ask_before_large,
    in_metres,
    settled,
    source_of,
)
from studies.cli.terminal import busy, say
from studies.geometry import CurvedMesh, OrganMesh, organ, scan, true_shape_of, vary
from studies.geometry.api.advice import with_command
from studies.geometry.doctor.examine import TISSUE, examine
from studies.geometry.files.units import NAMES, Source, check_unit
from studies.geometry.files.writing import SURFACES, VOLUMES, check_target, holds_tetrahedra, write_mesh
from studies.geometry.mesh.quality import dihedral_angles
from studies.geometry.organs import SHAPES
from studies.meshing.bounds import SHAPE, SHAPE_VOLUME
from studies.meshing.rest_surface import RestSurface, rest_surfaces
from studies.meshing.shaping import boundary_facets, curved_mesh
from studies.meshing.true_surface import ShapeErrors, shape_errors
from studies.scene.scene import Organ
from studies.scene.scene_file import organ_options

NODES = 550
TRIES = 4
"""Numbers of nodes that are tried."""
LEAST, SAFETY, MOST = 1.2, 1.1, 3.0
"""Steps between them: the distance of flat sides falls as the area of a facet does, of curved ones faster."""


def mesh(
    name: Annotated[str, typer.Argument(help="an organ (see `organbench list organs`); leave it out with --from")] = "",
    source: Annotated[Path | None, typer.Option("--from", help="a file instead: STL, OBJ, VTK, glTF, a mask …")] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help=f"{' '.join(VOLUMES + SURFACES)}")] = Path("mesh.vtu"),
    nodes: Annotated[int | None, typer.Option(min=1, help="outer nodes; without it a file keeps its own")] = None,
    fill: Annotated[bool | None, typer.Option("--fill/--surface", help="with tetrahedra, or only the surface")] = None,
    order: Annotated[int, typer.Option(min=1, max=2, help="2: curved elements that follow the true shape")] = 1,
    wall: Annotated[float | None, typer.Option(help="wall thickness of a hollow body in mm")] = None,
    seed: Annotated[int | None, typer.Option(help="seed of a random, plausible variation of the organ")] = None,
    smooth: Annotated[float, typer.Option(help="close folds and level bumps of this size in mm (--from)")] = 0.0,
    solid: Annotated[float | None, typer.Option(help="fill a shell, close openings up to so many mm (--from)")] = None,
    close_holes: Annotated[bool, typer.Option("--close-holes", help="close holes with flat lids (--from)")] = False,
    unit: Unit = None,
    scale: Scale = 1.0,
    longest_side: LongestSide = None,
    part: Part = None,
    write_unit: Annotated[str, typer.Option(help="unit of the written lengths: m, cm, mm, um or in")] = "m",
    check: Annotated[Path | None, typer.Option(metavar="FILE", help="only list the faults of this mesh")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="as JSON (--check; docs/meshes.md lists the keys)")] = False,
    modulus: Annotated[float, typer.Option(help="shear modulus \\[Pa], for the time step of --check")] = TISSUE[0],
    density: Annotated[float, typer.Option(help="density \\[kg/m³], for the time step of --check")] = TISSUE[1],
    yes: Yes = False,
) -> None:
    """Mesh a synthetic organ or a surface in a file, which is welded, oriented, remeshed and filled.

    --check FILE lists the faults of a mesh and how to repair each. Exit code 0: none, 1: some, 2: unreadable.
    """
    if check is not None:
        if name or source is not None:
            raise StudyError("--check FILE makes no mesh; leave out the organ, and --from")
        mesh_check(check, unit, scale, longest_side, part, as_json, modulus, density, yes)
    check_unit(write_unit)
    check_target(output, source)
    filled = check_filling(output, fill, order)
    if bool(name) == (source is not None):
        raise StudyError("name what to mesh: an organ (see `organbench list`), or --from FILE")
    if source is not None and seed is not None:
        raise StudyError("--seed varies synthetic organs; leave it out for a file")
    if source is None:
        given = {"--smooth": smooth, "--close-holes": close_holes, "--solid": solid, "--unit": unit}
        given |= {"--scale": scale != 1.0, "--longest-side": longest_side, "--part": part}
        wrong = [option for option, value in given.items() if value not in (None, False)]
        if wrong:
            raise StudyError(f"{' and '.join(wrong)} are for files (--from); leave them out for a synthetic organ")

        def make(count: int | None) -> Made:
            mesh = synthetic(name, NODES if count is None else count, seed, wall, filled, exact=order == 1)
            return Made(mesh, curved_mesh(mesh, None) if order == 2 else None)
    else:
        file = settled(source_of(source, unit, scale, longest_side, part), yes)
        how = {"smooth": smooth * MM, "solid": in_metres(solid), "wall": in_metres(wall), "holes": close_holes}

        def make(count: int | None) -> Made:
            mesh = scan(file, count, fill=filled, on_shape=order == 2, **how)
            shape = true_shape_of(file, **how) if count is not None and order == 2 else None
            return Made(mesh, curved_mesh(mesh, shape) if order == 2 else None)

    with busy(f"meshing {name or (source and source.name)}"):
        made = make(nodes)
    with busy("writing"):
        write_mesh(made.mesh, output, write_unit, made.curved)
    for line in nearness(made):
        say(line)
    if source is None:
        say(closeness(made, Organ(name, made.mesh.recipe["parameters"]), make))
    elif nodes is not None:
        sized_file = file if file.longest_side is not None else replace(file, unit=made.mesh.recipe["unit"])
        say(closeness(made, Organ("file", organ_options(sized_file, how)), make))
    say(f"{summary(made)}; written to {output} in {NAMES[write_unit]}")


def examined(source: Source, tissue: tuple[float, float], as_json: bool) -> None:
    """Prints the faults of a file; ends with exit code 1 where it has some."""
    with busy(f"examining {source.path.name}"):
        report = examine(source, tissue=tissue)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the file is read again
            report = with_command(source, report)
    if as_json:
        print(json.dumps(report.to_dict(), indent=2, allow_nan=False))
    else:
        findings.show(report)
    raise typer.Exit(0 if report.clean else 1)


class Made(NamedTuple):
    """A mesh, and the same with curved sides where an option requests them."""

    mesh: OrganMesh
    curved: CurvedMesh | None

    @property
    def sides(self) -> dict[str, RestSurface]:
        """Its outer surface and lumen, as curved as they are."""
        mesh, curved = self
        if curved is None:
            return rest_surfaces(mesh.points, mesh.triangles)
        return rest_surfaces(curved.points, boundary_facets(mesh, curved.cells))

    def errors(self, truth: Organ) -> ShapeErrors:
        return shape_errors(truth, self.sides, filled=len(self.mesh.tetrahedra) > 0)


def mesh_check(
    file: Path,
    unit: Unit = None,
    scale: Scale = 1.0,
    longest_side: LongestSide = None,
    part: Part = None,
    as_json: Annotated[bool, typer.Option("--json")] = False,
    modulus: float = TISSUE[0],
    density: float = TISSUE[1],
    yes: Yes = False,
) -> None:
    """`organbench mesh --check FILE` by its former name."""
    ask_before_large(file, yes)
    examined(source_of(file, unit, scale, longest_side, part), (modulus, density), as_json)


def check_filling(output: Path, fill: bool | None, order: int) -> bool:
    """Whether the body gets tetrahedra: by the option, or by the file format. Raises StudyError where it cannot."""
    filled = holds_tetrahedra(output) if fill is None else fill
    if filled and not holds_tetrahedra(output):
        raise StudyError(f"{output.name}: {output.suffix} holds triangles only; use .vtu, or leave out --fill")
    if order == 2 and not filled:
        raise StudyError("curved elements (--order 2) fill a body; leave out --surface and write .vtu, .vtk or .msh")
    return filled


def synthetic(name: str, nodes: int, seed: int | None, wall: float | None, filled: bool, exact: bool) -> OrganMesh:
    """An organ of SHAPES, varied by its seed, with a wall [mm] if it can have one; `exact`: with flat sides and yet its
    true volume."""
    lookup(name, SHAPES, "organ")
    parameters: dict[str, float] = {} if seed is None else dict(vary(name, seed))
    if wall is not None:
        hollow = [shape for shape, make in SHAPES.items() if "wall" in make.__code__.co_varnames]
        if name not in hollow:
            raise StudyError(f"the {name} is solid; --wall is for {', '.join(hollow)}, or for a file (--from)")
        # The ball's parameters are in metres, the organs' in millimetres.
        parameters["wall"] = wall * MM if name == "ball" else wall
    return organ(name, nodes, fill=filled, parameters=parameters, exact=exact, sides="straight" if exact else "curved")


def closeness(made: Made, truth: Organ, make: Callable[[int | None], Made]) -> str:
    """How far a mesh is from its true surface, and where that is too far, how many nodes are not: `make` meshes that
    number."""
    errors, count = made.errors(truth), made.mesh.outer_count
    sentence, bounds = f"shape: {errors}", f"within {SHAPE:g} % and {SHAPE_VOLUME:g} %"
    if not errors.worst > 1.0:
        return sentence
    with busy("looking for the number of nodes that keeps the shape"), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of meshes that are not the output
        for _ in range(TRIES):
            count = 10 * int(np.ceil(0.1 * count * min(max(LEAST, SAFETY * errors.worst), MOST)))
            try:
                errors = make(count).errors(truth)
            except StudyError:
                continue  # Not lost: more nodes follow.
            if errors.worst <= 1.0:
                return f"{sentence}; {count:,} nodes keep it {bounds}"
    return f"{sentence}; {count:,} nodes do not keep it {bounds} either"


def nearness(made: Made) -> list[str]:
    """How near a mesh is to its file, a line for each direction and one for the volume; none for other meshes."""
    lost = made.mesh.losses
    if not lost:
        return []
    rows = []
    ways = {"file_to_mesh": "file to mesh", "mesh_to_file": "mesh to file", "lumen": "lumen of the file to the mesh's"}
    for key, way in ways.items():
        if key not in lost:
            continue
        mean, most, far = (1e3 * lost[key][kind] for kind in ("mean", "p95", "max"))
        where = ", ".join(f"{1e3 * x:.4g}" for x in lost[key]["where"])
        largest = f"largest {far:.3g} mm ({0.1 * far / lost['diagonal']:.2g} % of the diagonal) at ({where}) mm"
        rows.append(f"{way}: mean {mean:.2g} mm, 95 % within {most:.2g} mm, {largest}")
    before, after = lost["volume_file"], lost["volume_mesh"]
    if "lumen" in lost and made.curved is not None:
        after = made.curved.volume
    change = 100 * (after / before - 1)
    return [*rows, f"volume: file {1e6 * before:.5g} mL, mesh {1e6 * after:.5g} mL ({change:+.3f} %)"]


def summary(made: Made) -> str:
    mesh, smooth = made
    body = f", {len(mesh.tetrahedra):,} tetrahedra" if len(mesh.tetrahedra) else ""
    angle = f"{float(np.min(dihedral_angles(mesh.points, mesh.tetrahedra))):.3g}" if body else ""
    flattest = f", flattest angle {angle} degrees" if body else ""
    inside = mesh.lumen_volume if smooth is None or not mesh.hollow else -made.sides["lumen"].volume
    lumen = f", lumen {1e6 * inside:.4g} mL" if mesh.hollow else ""
    surface = f"{mesh.outer_count:,} outer nodes, {len(mesh.outer_triangles):,} outer triangles"
    tissue = mesh.volume if smooth is None else smooth.volume
    return f"{mesh.name}: {surface}{body}, tissue {1e6 * tissue:.4g} mL{lumen}{flattest}"
