"""`organbench mesh-check`: what is wrong with a mesh."""

import json
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from studies.cli.mesh_files import LongestSide, Part, Scale, Unit, Yes, ask_before_large, source_of, working
from studies.cli.terminal import console
from studies.geometry.api.advice import NODES, with_command
from studies.geometry.doctor.examine import TISSUE, Findings, examine
from studies.geometry.files.content import LISTED


def mesh_check(
    path: Annotated[Path, typer.Argument(help="a mesh file: STL, OBJ, PLY, VTK, VTU, MSH, OFF …")],
    unit: Unit = None,
    scale: Scale = 1.0,
    longest_side: LongestSide = None,
    part: Part = None,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON (docs/meshes.md lists the keys)")] = False,
    modulus: Annotated[float, typer.Option(help="shear modulus of the tissue \\[Pa], for the time step")] = TISSUE[0],
    density: Annotated[float, typer.Option(help="density of the tissue \\[kg/m³], for the time step")] = TISSUE[1],
    yes: Yes = False,
) -> None:
    """List the faults of a mesh and how to repair each. Exit code 0: none, 1: some, 2: unreadable."""
    source = source_of(path, unit, scale, longest_side, part)
    ask_before_large(path, yes)
    with working(f"examining {path.name}"):
        report = examine(source, tissue=(modulus, density))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the file is read again
            report = with_command(source, report)
    if as_json:
        print(json.dumps(report.to_dict(), indent=2, allow_nan=False))
    else:
        show(report)
    raise typer.Exit(0 if report.clean else 1)


def show(report: Findings) -> None:
    """The findings and the numbers behind them, for a person."""
    table = Table(show_header=False, box=None, title=report.name, title_justify="left")
    for key, value in rows_of(report.measures):
        table.add_row(key, value)
    console.print(table)
    if len(report.measures["part_list"]) > 1:
        console.print(parts_table(report.measures["part_list"]))
    for number, finding in enumerate(report.findings, start=1):
        console.print(f"{number}. {finding.sentence}", markup=False, highlight=False)
        console.print(f"   -> {finding.mend}", markup=False, highlight=False)
    if report.command:
        console.print(f"tested; this gives a clean body of {NODES} surface nodes:", highlight=False)
        console.print(report.command, markup=False, highlight=False, soft_wrap=True)
    if report.clean:
        console.print("no faults found")


def parts_table(parts: list[dict[str, Any]]) -> Table:
    """The parts of a file that holds several."""
    table = Table("part", "name", "triangles", "size \\[mm]", box=None, title="parts (--part)", title_justify="left")
    for row in parts[:LISTED]:
        size = " x ".join(f"{1e3 * side:.4g}" for side in row["size"])
        table.add_row(str(row["number"]), Text(row["name"]), f"{row['triangles']:,}", size)
    if len(parts) > LISTED:
        table.add_row("…", f"{len(parts) - LISTED} more")
    return table


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
