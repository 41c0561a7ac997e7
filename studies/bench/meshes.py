"""How good the meshes of a population of organs are: `python -m studies.bench.meshes`.

Random organs of every kind are meshed, filled and curved from nothing; every one is checked, the distribution of the
quality is printed and the worst is named. Writes results/geometry.csv. `make bench` runs a short form of it.
"""

import argparse
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from rich.console import Console

from studies.base.errors import StudyError
from studies.geometry import OrganMesh, check_surface, check_tetrahedra, curved, organ, organ_family, vary
from studies.geometry.mesh.organ_mesh import boundary_triangles, same_triangles, unique_edges
from studies.geometry.mesh.quality import (
    MIN_DIHEDRAL,
    MIN_RATIO,
    MIN_WALL_RATIO,
    dihedral_angles,
    tetrahedron_radius_ratio,
)
from studies.geometry.organs import make_shape
from studies.geometry.surface.first_surface import true_volume
from studies.store.stamps import set_stamp
from studies.store.tables import write_table

ORGANS = ("liver", "stomach", "kidney", "spleen", "bladder")
Row = dict[str, Any]
QUALITY = ("dihedral_min", "dihedral_p1", "dihedral_p50", "ratio_min", "ratio_p1", "ratio_p50", "jacobian_min")
FAMILY = (550, 1100, 2200)
"""Nodes of the meshes whose order of convergence is observed."""


@contextmanager
def empty_cache() -> Iterator[None]:
    """A cache of its own, so that everything is made from nothing."""
    before = os.environ.get("ORGANBENCH_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["ORGANBENCH_CACHE"] = folder
        try:
            yield
        finally:
            if before is None:
                del os.environ["ORGANBENCH_CACHE"]
            else:
                os.environ["ORGANBENCH_CACHE"] = before


def specimen(name: str, seed: int, nodes: int) -> Row:
    """One random organ from nothing: what it is, whether it is sound, how good its worst element is, and how long it
    took. A failure is a row with its sentence."""
    row: Row = {"organ": name, "seed": seed, "nodes": nodes, "message": "", "hollow": False}
    start = time.perf_counter()
    try:
        mesh = organ(name, nodes, parameters=vary(name, seed))
        made = curved(mesh)
        row["seconds"] = time.perf_counter() - start
        check_topology(mesh)
    except StudyError as error:
        return row | {"message": str(error), "seconds": time.perf_counter() - start}
    again = time.perf_counter()
    curved(organ(name, nodes, parameters=vary(name, seed)))
    ratio = tetrahedron_radius_ratio(mesh.points, mesh.tetrahedra)
    angle = dihedral_angles(mesh.points, mesh.tetrahedra).min(axis=1)
    return row | {
        "cached_seconds": time.perf_counter() - again,
        "hollow": mesh.hollow,
        "tetrahedra": len(mesh.tetrahedra),
        "volume_ml": 1e6 * made.volume,
        "straight_over_curved": mesh.volume / made.volume,
        "dihedral_min": angle.min(),
        "dihedral_p1": np.quantile(angle, 0.01),
        "dihedral_p50": np.median(angle),
        "ratio_min": ratio.min(),
        "ratio_p1": np.quantile(ratio, 0.01),
        "ratio_p50": np.median(ratio),
        "jacobian_min": made.smallest_jacobian,
    }


def check_topology(mesh: OrganMesh) -> None:
    """Raise StudyError unless both surfaces are closed, outward and of genus 0, and bound the fill node by node."""
    check_tetrahedra(mesh.points, mesh.tetrahedra, mesh.name)
    for part, triangles in (("outer surface", mesh.outer_triangles), ("lumen", mesh.lumen_triangles)):
        if not len(triangles):
            continue
        used, corners = np.unique(triangles, return_inverse=True)
        check_surface(mesh.points[used], corners.reshape(-1, 3), f"{mesh.name}: {part}")
        euler = len(used) - len(unique_edges(triangles)) + len(triangles)
        if euler != 2:
            raise StudyError(f"{mesh.name}: the {part} has Euler characteristic {euler}, a sphere has 2; mesh it again")
    if not same_triangles(boundary_triangles(mesh.tetrahedra), mesh.triangles):
        raise StudyError(f"{mesh.name}: the fill ends elsewhere than at the surface; mesh it again")


def population(each: int, nodes: int, first: int = 0) -> list[Row]:
    """`each` random organs of every kind."""
    with empty_cache():
        return [specimen(name, seed, nodes) for name in ORGANS for seed in range(first, first + each)]


def faults(rows: list[Row]) -> list[Row]:
    """Those that failed or whose worst element is under the limits of quality.py."""
    return [row for row in rows if row["message"] or not is_good(row)]


def is_good(row: Row) -> bool:
    """Whether the worst element keeps the limits; that of the angle is for solids: a thin wall is flat by nature."""
    steep = row["hollow"] or row["dihedral_min"] >= MIN_DIHEDRAL
    return steep and row["ratio_min"] >= (MIN_WALL_RATIO if row["hollow"] else MIN_RATIO) and row["jacobian_min"] > 0


def summary(rows: list[Row]) -> list[Row]:
    """By organ: how many, the worst and the distribution of the quality, the worst one's seed, the median times."""
    lines = []
    for name in dict.fromkeys(row["organ"] for row in rows):
        group = [row for row in rows if row["organ"] == name]
        good = [row for row in group if not row["message"]]
        line: Row = {"organ": name, "meshed": f"{len(good)}/{len(group)}"}
        if good:
            line |= {
                key: float(np.median([row[key] for row in good])) for key in ("seconds", "cached_seconds", *QUALITY)
            }
            line |= {key: min(row[key] for row in good) for key in QUALITY if key.endswith("_min")}
            line["worst seed"] = min(good, key=lambda row: row["ratio_min"])["seed"]
        lines.append(line)
    return lines


def convergence(name: str, sizes: tuple[int, ...] = FAMILY) -> tuple[float, float, float]:
    """Volume error of the curved mesh at the first of `sizes`, and the observed orders of the straight and the curved
    family in the length of an edge."""
    exact = true_volume(make_shape(name, {}))
    meshes = organ_family(name, sizes)
    straight = np.array([abs(mesh.volume / exact - 1.0) for mesh in meshes])
    smooth = np.array([abs(curved(mesh).volume / exact - 1.0) for mesh in meshes])
    edge = -0.5 * np.log(sizes)
    orders = [float(np.polyfit(edge, np.log(error), 1)[0]) for error in (straight, smooth)]
    return float(smooth[0]), orders[0], orders[1]


def promises(each: int = 2) -> Iterator[tuple[str, float, str, float, bool, str]]:
    """What `make bench` shows of the meshes: what, measured, unit, target, whether that is a most, a note."""
    rows = population(each, 550)
    good = [row for row in rows if not row["message"]]
    sound = 1 - len(faults(rows)) / len(rows)
    slowest = [max(line.get(key, np.nan) for line in summary(rows)) for key in ("seconds", "cached_seconds")]
    note = f"seeds 0 to {each - 1} of {', '.join(ORGANS)}"
    yield "random organs of 550 nodes that are sound", sound, "1", 1.0, False, note
    yield "organ: surface, fill, curved from nothing", slowest[0], "s", 3.0, True, "slowest kind"
    yield "the same, cached", slowest[1], "s", 0.1, True, "slowest kind"
    for what, key, hollow, unit, least in (
        ("smallest dihedral angle, solids", "dihedral_min", False, "degrees", MIN_DIHEDRAL),
        ("smallest radius ratio, solids", "ratio_min", False, "1", MIN_RATIO),
        ("smallest radius ratio, walls", "ratio_min", True, "1", MIN_WALL_RATIO),
    ):
        worst = min((row[key] for row in good if row["hollow"] == hollow), default=np.nan)
        yield what, worst, unit, least, False, ""
    with empty_cache():
        start = time.perf_counter()
        mesh = organ("liver", 19_000)
        seconds = time.perf_counter() - start
        convergences = {name: convergence(name) for name in ORGANS}
    yield "liver of 19,000 nodes, surface and fill", seconds, "s", 25.0, True, f"{len(mesh.tetrahedra)} elements"
    for k, (what, target, at_most) in enumerate(
        (
            (f"curved volume error at {FAMILY[0]} nodes", 5e-4, True),
            ("observed order of the volume, straight", 1.8, False),
            ("observed order of the volume, curved", 3.5, False),
        )
    ):
        worst = (max if at_most else min)(ORGANS, key=lambda name, k=k: convergences[name][k])
        yield what, convergences[worst][k], "1", target, at_most, f"worst: {worst}"


def main() -> int:
    """Mesh the population, print and store what came out; 1 when one of them is at fault."""
    parser = argparse.ArgumentParser(description="How good the meshes of random organs are.")
    parser.add_argument("--each", type=int, default=40, help="random organs of each kind")
    parser.add_argument("--nodes", type=int, default=550, help="nodes of the outer surface")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder for geometry.csv")
    wish = parser.parse_args()
    rows = population(wish.each, wish.nodes, wish.first)
    console = Console(soft_wrap=True)
    lines = pd.DataFrame(summary(rows))
    console.print(lines.to_string(index=False, float_format=lambda v: f"{v:.3g}"), markup=False)
    bad = faults(rows)
    for row in bad:
        fault = row["message"] or "an element is under the limits"
        console.print(f"{row['organ']} {row['seed']}: {fault}", markup=False)
    console.print(f"{len(rows) - len(bad)} of {len(rows)} organs are sound")
    console.print(f"wrote {write_table(wish.results / 'geometry.csv', pd.DataFrame(rows))}", markup=False)
    set_stamp(wish.results, "geometry.csv")
    return int(len(bad) > 0)


if __name__ == "__main__":
    raise SystemExit(main())
