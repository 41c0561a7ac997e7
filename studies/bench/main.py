"""The promised numbers, measured: `make bench` on a quiet machine. Prints each stage as it ends, writes
results/bench.csv."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer
from rich.console import Console

from massspring import (
    Free,
    ImplicitVolume,
)
from reference_fem import bench as reference_bench
from reference_fem import crosscheck, equilibrium_path
from reference_fem.crosscheck.bench import iteration_ratio
from reference_fem.exact import BALL_BETWEEN_PLANES
from studies.bench import meshes as geometry_bench
from studies.bench.cut import cut_lines
from studies.bench.elements import element_lines
from studies.bench.line import BenchLine
from studies.bench.plain import plain_lines
from studies.bench.plain_points import plain_points_lines
from studies.bench.slide import slide_lines
from studies.bench.solver import growth_lines, large_lines, step_lines, threads_lines, volumes_lines
from studies.metrics.timing.protocol import pinned
from studies.reference.problem import reference_problem, whole_forces
from studies.runs.case import BodyRecipe, Case
from studies.runs.run import measure
from studies.scene.library.ball_squeeze import BALL_SQUEEZE, PRESS_END, RADIUS
from studies.store.stamps import set_stamp
from studies.store.tables import write_table

APPROACHES = (0.10, 0.20, 0.30)
"""Of the planes over the diameter, at which the reference is held against the converged solution."""


def volume_lines() -> list[BenchLine]:
    """Worst volume error of ball_squeeze with the constraint, at two time steps; and what is lost without it."""
    lines = []
    for kind in ("tetrahedral", "surface"):
        for fraction, target in ((0.5, 3e-4), (0.05, 1e-5)):
            case = Case(BALL_SQUEEZE, BodyRecipe(kind), ImplicitVolume(), dt_fraction=fraction)
            lines.append(BenchLine(f"ball_squeeze {kind}, |V/V0 - 1| at {fraction:g} dt_c", _worst(case), "1", target))
    free = Case(BALL_SQUEEZE, BodyRecipe("tetrahedral"), Free())
    lines.append(BenchLine("ball_squeeze tetrahedral, free: loss", _worst(free), "1", 0.05, at_most=False))
    return lines


def _worst(case: Case) -> float:
    record = measure(case)
    return float(np.max(np.abs(record.fields["volume"].values / record.fields["volume_target"].values - 1)))


def reference_lines() -> list[BenchLine]:
    """The reference on ball_squeeze against oracle 5."""
    assert BALL_SQUEEZE.reference is not None
    level = BALL_SQUEEZE.reference.levels[-1]
    problem = reference_problem(BALL_SQUEEZE, level)
    times = [PRESS_END * share / 0.30 for share in APPROACHES]
    path = equilibrium_path(problem, times)
    scale = BALL_SQUEEZE.tissue.shear_modulus * RADIUS**2
    lines = []
    for share, equilibrium in zip(APPROACHES, path, strict=True):
        force, equator = BALL_BETWEEN_PLANES[share]
        got = float(-whole_forces(BALL_SQUEEZE, equilibrium.obstacle_force[None])[0, 0, 2]) / scale
        radius = float(np.hypot(*(problem.mesh.doflocs[:2] + equilibrium.u.T[:2])).max()) / RADIUS
        lines.append(BenchLine(f"reference force at d = {share:.2f}, deviation", abs(got / force - 1), "1", 5e-3))
        lines.append(
            BenchLine(f"reference equator at d = {share:.2f}, deviation", abs(radius / equator - 1), "1", 5e-4)
        )
    lines.append(BenchLine("reference volume change", abs(path[-1].volume / path[-1].volume0 - 1), "1", 1e-4))
    return lines


def speed_lines() -> list[BenchLine]:
    """Assembly and a Newton iteration of the reference on one pinned core."""
    with pinned(threads=1):
        cost = reference_bench.iteration_costs(cells=7)
    note = f"{cost['unknowns']:.0f} unknowns"
    return [
        BenchLine(
            "assembly of tangent and residual", cost["assembled_per_s"], "unknowns/s", 400e3, at_most=False, note=note
        ),
        BenchLine("Newton iteration", cost["iteration_s"], "s", 0.2, note=note),
    ]


def path_lines() -> list[BenchLine]:
    """Ten load steps with contact on a mesh of about 45,000 unknowns (twelve cells to an edge: 49,000), on one core."""
    with pinned(threads=1):
        cost = reference_bench.contact_path(cells=12, steps=10)
    note = f"{cost['unknowns']} unknowns, ten load steps, one thread on one core"
    return [
        BenchLine("quasi-static path with contact", cost["wall_s"], "s", 240.0, note=note),
        BenchLine("its peak memory", cost["peak_bytes"] / 1e9, "GB", 3.0, note=f"{note}; of the whole process"),
        BenchLine("its Newton iterations per step, median", float(np.median(cost["iterations"])), "1", 6.0, note=note),
    ]


def second_code_lines() -> list[BenchLine]:
    """A Newton iteration of the reference over one of NGSolve's own Newton, same problem, mesh and core."""
    if not crosscheck.available():
        return []
    with pinned(threads=1):
        cost = iteration_ratio()
    note = f"{cost['unknowns']} unknowns; NGSolve with {cost['inverse']}: {cost['ngsolve_s']:.3g} s"
    return [BenchLine("Newton iteration over NGSolve's", cost["ratio"], "1", 1.5, note=note)]


def geometry_lines() -> list[BenchLine]:
    """Meshes of random organs, of a fine liver and of families."""
    return [BenchLine(*promise) for promise in geometry_bench.promises()]


def main(results: Annotated[Path, typer.Option(help="folder of the results")] = Path("results")) -> None:
    """Measures everything; the table says for each number whether it is met."""
    stages: tuple[Callable[[], list[BenchLine]], ...] = (
        step_lines,
        plain_lines,
        plain_points_lines,
        large_lines,
        threads_lines,
        slide_lines,
        element_lines,
        cut_lines,
        growth_lines,
        volumes_lines,
        volume_lines,
        reference_lines,
        speed_lines,
        path_lines,
        second_code_lines,
        geometry_lines,
    )
    lines, console = [], Console(soft_wrap=True)
    for stage in stages:
        for line in stage():
            console.print(line.words, markup=False, highlight=False)
            lines.append(line)
    table = pd.DataFrame(
        {
            "what": [line.what for line in lines],
            "measured": [line.measured for line in lines],
            "unit": [line.unit for line in lines],
            "target": [line.promise for line in lines],
            "met": [line.verdict for line in lines],
            "note": [line.note for line in lines],
        }
    )
    if not crosscheck.available():
        console.print("not measured: NGSolve's Newton iteration; install organbench[crosscheck]", markup=False)
    write_table(results / "bench.csv", table)
    set_stamp(results, "bench.csv")


if __name__ == "__main__":
    typer.run(main)
