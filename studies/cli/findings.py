"""What the mesh doctor found, for a person."""

from typing import Any

from rich.table import Table
from rich.text import Text

from studies.cli.terminal import console, say
from studies.geometry.api.advice import NODES
from studies.geometry.doctor.examine import Findings
from studies.geometry.doctor.findings import REMARKS
from studies.geometry.files.content import LISTED


def show(report: Findings) -> None:
    table = Table(show_header=False, box=None, title=report.name, title_justify="left")
    for row in rows_of(report.measures):
        table.add_row(*row)
    console.print(table)
    if len(report.measures["part_list"]) > 1:
        console.print(parts_table(report.measures["part_list"]))
    for number, finding in enumerate(report.findings, start=1):
        first = "remark:" if finding.code in REMARKS else f"{number}."
        say(f"{first} {finding.sentence}\n   -> {finding.mend}")
    if report.command:
        say(f"tested; this gives a clean body of {NODES} surface nodes:\n{report.command}")
    if report.clean:
        say("no faults found")


def parts_table(parts: list[dict[str, Any]]) -> Table:
    table = Table("part", "name", "cells", "size \\[mm]", box=None, title="parts (--part)", title_justify="left")
    for row in parts[:LISTED]:
        table.add_row(str(row["number"]), Text(row["name"]), f"{row['cells']:,}", in_mm(row["size"]))
    if len(parts) > LISTED:
        table.add_row("…", f"{len(parts) - LISTED} more")
    return table


def in_mm(sides: list[float]) -> str:
    """Sides of a box [m] in millimetres."""
    return " x ".join(f"{1e3 * side:.4g}" for side in sides)


def rows_of(m: dict[str, Any]) -> list[tuple[str, str]]:
    if m["bad_points"]:
        return [("points", f"{m['points_in_file']:,}")]
    cells = f", {m['tetrahedra']:,} tetrahedra" if "tetrahedra" in m else ""
    lumen = f" round a lumen of {1e6 * m['lumen_volume']:.4g} mL" if m["lumens"] else ""
    rows = [
        ("holds", f"{m['nodes']:,} nodes, {m['triangles']:,} triangles{cells}"),
        ("size", f"{in_mm(m['size'])} mm"),
        ("volume, area", f"{1e6 * m['volume']:.4g} mL{lumen}, {1e4 * m['area']:.4g} cm2"),
        ("closed, manifold, oriented", ", ".join("yes" if m[k] else "no" for k in ("closed", "manifold", "oriented"))),
        ("parts, lumens, handles", f"{m['parts']}, {m['lumens']}, {'-' if m['genus'] is None else m['genus']}"),
    ]
    if ratio := m["triangle_radius_ratio"]:
        percentiles = f"worst {ratio['min']:.2g}, 1 % under {ratio['p1']:.2g}, 5 % under {ratio['p5']:.2g}"
        rows.append(("triangle radius ratio", f"{percentiles}, median {ratio['p50']:.2g}"))
    if "tetrahedra" in m:
        angle = m["dihedral_angle"]
        rows.append(("flattest angle", f"{angle['min']:.3g} degrees, 1 % under {angle['p1']:.3g}"))
    springs = m["springs"]
    tissue = f"mu = {springs['shear_modulus']:g} Pa, rho = {springs['density']:g} kg/m3"
    step = f"time step under {1e3 * springs['dt_limit']:.3g} ms ({springs['how']}, {tissue})"
    return [*rows, ("springs", f"shortest edge {1e3 * springs['shortest_edge']:.3g} mm, {step}")]
