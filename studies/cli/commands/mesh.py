"""`organbench mesh` and `organbench check`: from a name or a file to a mesh, and what is wrong with one."""

import json
import sys
import warnings
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.table import Table

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.cli.terminal import console, errors, working
from studies.geometry import OrganMesh, curved, organ, scan, vary
from studies.geometry.api.scans import longest_side
from studies.geometry.doctor.examine import TISSUE, Findings, examine
from studies.geometry.files.estimate import size_warning
from studies.geometry.files.units import NAMES, UNITS, check_unit, likely_units, unit_question
from studies.geometry.files.writing import SURFACES, VOLUMES, check_target, holds_tetrahedra, write_mesh
from studies.geometry.mesh.quality import dihedral_angles
from studies.geometry.organs import SHAPES

MM = 1e-3
NODES = 550

Unit = Annotated[str | None, typer.Option(help="of the file's coordinates: m, cm or mm")]
Yes = Annotated[bool, typer.Option("--yes", "--force", help="read a very large file without asking")]


def mesh(
    name: Annotated[str, typer.Argument(help="an organ (see `organbench list`); none with --from")] = "",
    source: Annotated[Path | None, typer.Option("--from", help="a file instead: STL, OBJ, PLY, VTK, …")] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help=f"{' '.join(VOLUMES + SURFACES)}")] = Path("mesh.vtu"),
    nodes: Annotated[int | None, typer.Option(help="of the outer surface; a file keeps its own without it")] = None,
    fill: Annotated[bool | None, typer.Option("--fill/--surface", help="with tetrahedra, or without")] = None,
    order: Annotated[int, typer.Option(min=1, max=2, help="2: curved elements that follow the true shape")] = 1,
    wall: Annotated[float | None, typer.Option(help="hollow, with a wall of so many millimetres")] = None,
    seed: Annotated[int | None, typer.Option(help="a random but plausible variation of the organ")] = None,
    smooth: Annotated[float, typer.Option(help="close folds, level bumps of so many millimetres (--from)")] = 0.0,
    close_holes: Annotated[bool, typer.Option("--close-holes", help="put flat lids on holes (--from)")] = False,
    unit: Unit = None,
    write_unit: Annotated[str, typer.Option(help="of the lengths that are written: m, cm or mm")] = "m",
    yes: Yes = False,
) -> None:
    """Makes a mesh: of a synthetic organ, or from a file (welded, oriented, remeshed, filled)."""
    if bool(name) == (source is not None):
        raise StudyError("say what to mesh: the name of an organ (see `organbench list`), or --from FILE")
    check_target(output, source)
    check_unit(write_unit)
    filled = holds_tetrahedra(output) if fill is None else fill
    if filled and not holds_tetrahedra(output):
        raise StudyError(f"{output.name}: {output.suffix} holds triangles only; use .vtu, or leave --fill out")
    if order == 2 and not filled:
        raise StudyError("curved elements (--order 2) fill a body; leave --surface out, and write .vtu, .vtk or .msh")
    if source is None:
        refuse_file_options(smooth, close_holes, unit)
        with working(f"meshing the {name}"):
            made = synthetic(name, nodes or NODES, seed, wall, filled)
    else:
        if seed is not None:
            raise StudyError("--seed varies synthetic organs; a file comes as it is, leave it out")
        ask_before_large(source, yes)
        chosen_unit = unit if unit is not None else asked_unit(source)
        options: dict[str, Any] = {"smooth": smooth * MM, "holes": close_holes, "fill": filled}
        with working(f"meshing {source.name}"):
            made = scan(source, nodes, unit=chosen_unit, wall=None if wall is None else wall * MM, **options)
    with working("curving" if order == 2 else "writing"):
        write_mesh(made, output, write_unit, curved(made) if order == 2 else None)
    console.print(f"{summary(made)}; written to {output} in {NAMES[write_unit]}", markup=False, highlight=False)


def refuse_file_options(smooth: float, close_holes: bool, unit: str | None) -> None:
    """Raise StudyError for options that only a file can have."""
    given = {"--smooth": bool(smooth), "--close-holes": close_holes, "--unit": unit is not None}
    wrong = [option for option, used in given.items() if used]
    if wrong:
        raise StudyError(f"{' and '.join(wrong)} are for files (--from); a synthetic organ needs none of it")


def synthetic(name: str, nodes: int, seed: int | None, wall: float | None, filled: bool) -> OrganMesh:
    """An organ of SHAPES, varied by its seed, with a wall [mm] if it can have one."""
    lookup(name, SHAPES, "organ")
    parameters: dict[str, float] = {} if seed is None else dict(vary(name, seed))
    if wall is not None:
        hollow = [known for known, make in SHAPES.items() if "wall" in make.__code__.co_varnames]
        if name not in hollow:
            raise StudyError(f"the {name} is solid; --wall is for {', '.join(hollow)}, or for a file (--from)")
        # The ball's parameters are in metres, the organs' in millimetres.
        parameters["wall"] = wall * MM if name == "ball" else wall
    return organ(name, nodes, fill=filled, parameters=parameters)


def check(
    path: Annotated[Path, typer.Argument(help="a mesh file: STL, OBJ, PLY, VTK, VTU, MSH, OFF …")],
    unit: Unit = None,
    as_json: Annotated[bool, typer.Option("--json", help="for machines; the keys are in docs/meshes.md")] = False,
    modulus: Annotated[float, typer.Option(help="shear modulus of the tissue [Pa], for the time step")] = TISSUE[0],
    density: Annotated[float, typer.Option(help="density of the tissue [kg/m^3], for the time step")] = TISSUE[1],
    yes: Yes = False,
) -> None:
    """Tells what is wrong with a mesh and what mends it: exit code 0 clean, 1 findings, 2 unreadable."""
    ask_before_large(path, yes)
    with working(f"examining {path.name}"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = examine(path, unit=unit, tissue=(modulus, density))
    if as_json:
        print(json.dumps(found.to_dict(), indent=2, allow_nan=False))
    else:
        show(found)
    raise typer.Exit(0 if found.clean else 1)


def show(found: Findings) -> None:
    """The findings and the numbers behind them, for a person."""
    table = Table(show_header=False, box=None, title=found.name, title_justify="left")
    for key, value in rows_of(found.measures):
        table.add_row(key, value)
    console.print(table)
    for number, finding in enumerate(found.findings, start=1):
        console.print(f"{number}. {finding.sentence}", markup=False, highlight=False)
        console.print(f"   -> {finding.mend}", markup=False, highlight=False)
    if found.clean:
        console.print("nothing is wrong with it")


def rows_of(m: dict[str, Any]) -> list[tuple[str, str]]:
    """The measures as a person reads them."""
    if m["bad_points"]:
        return [("points", f"{m['points_in_file']:,}")]
    cells = f", {m['tetrahedra']:,} tetrahedra" if "tetrahedra" in m else ""
    ratio, springs = m["triangle_radius_ratio"], m["springs"]
    rows = [
        ("holds", f"{m['nodes']:,} nodes, {m['triangles']:,} triangles{cells}"),
        ("size", " x ".join(f"{1e3 * side:.4g}" for side in m["size"]) + " mm"),
        ("volume, area", f"{1e6 * m['volume']:.4g} mL, {1e4 * m['area']:.4g} cm2"),
        ("closed, manifold, oriented", ", ".join("yes" if m[k] else "no" for k in ("closed", "manifold", "oriented"))),
        ("parts, lumens, handles", f"{m['parts']}, {m['lumens']}, {'-' if m['genus'] is None else m['genus']}"),
    ]
    if ratio:
        percentiles = f"worst {ratio['min']:.2g}, 1 % under {ratio['p1']:.2g}, 5 % under {ratio['p5']:.2g}"
        rows.append(("triangle radius ratio", f"{percentiles}, median {ratio['p50']:.2g}"))
    if "tetrahedra" in m:
        angle = m["dihedral_angle"]
        rows.append(("flattest angle", f"{angle['min']:.3g} degrees, 1 % under {angle['p1']:.3g}"))
    tissue = f"mu = {springs['shear_modulus']:g} Pa, rho = {springs['density']:g} kg/m3"
    step = f"time step under {1e3 * springs['dt_limit']:.3g} ms ({springs['how']}, {tissue})"
    return [*rows, ("springs", f"shortest edge {1e3 * springs['shortest_edge']:.3g} mm, {step}")]


def ask_before_large(path: Path, yes: bool) -> None:
    """Warn of a large file before reading it: go on when --yes or an answer allows it, else raise StudyError."""
    sentence = size_warning(path) if path.is_file() else None
    if sentence is None:
        return
    if yes:
        errors.print(f"warning: {sentence}", markup=False, highlight=False)
    elif not (sys.stdin.isatty() and typer.confirm(f"{sentence}. Go on?")):
        raise StudyError(f"{sentence}; say --yes to go on, or thin it out in the program that made it")


def asked_unit(path: Path) -> str | None:
    """The unit asked for at the terminal; None where it is not needed, or there is no terminal."""
    if not sys.stdin.isatty() or not path.is_file():
        return None
    side = longest_side(path)
    if likely_units(side) == ["m"]:
        return None
    likely = (likely_units(side) or ["mm"])[-1]
    answer = typer.prompt(f"{unit_question(path.name, side)}. Which unit is it ({', '.join(UNITS)})?", default=likely)
    check_unit(answer)
    return str(answer)


def summary(made: OrganMesh) -> str:
    """What was made, in a line."""
    body = f", {len(made.tetrahedra):,} tetrahedra" if len(made.tetrahedra) else ""
    flattest = (
        f", flattest angle {float(np.min(dihedral_angles(made.points, made.tetrahedra))):.3g} degrees" if body else ""
    )
    lumen = f", lumen {1e6 * made.lumen_volume:.4g} mL" if made.hollow else ""
    surface = f"{made.outer_count:,} outer nodes, {len(made.outer_triangles):,} outer triangles"
    return f"{made.name}: {surface}{body}, tissue {1e6 * made.volume:.4g} mL{lumen}{flattest}"
