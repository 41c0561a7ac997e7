"""`organbench profile`: where the time of a step goes, what the scene leaves out, and what that saves."""

from pathlib import Path
from typing import Annotated

import pandas as pd
import typer
from rich.table import Table

from studies.base.compile_watch import watching
from studies.cli.options import BodyKind, MethodName, SurfaceNodes, chosen_case
from studies.cli.progress import compiling
from studies.cli.terminal import SceneName, console, errors
from studies.metrics.timing.stage_cost import FRAME, SKIPPED, STAGE, cost_table
from studies.store.tables import write_table

HEADINGS = {STAGE: "stages of a step", SKIPPED: "left out here; what it would cost", FRAME: "Python between two frames"}


def profile(
    scene: SceneName,
    method: MethodName = "implicit_volume",
    body: BodyKind = "tetrahedral",
    nodes: SurfaceNodes = 550,
    csv: Annotated[Path | None, typer.Option(help="also write the table there")] = None,
    json: Annotated[bool, typer.Option("--json", help="print JSON instead of a table")] = False,
) -> None:
    """Measure the stages of a time step in microseconds, and what the scene leaves out. One pinned core."""
    case = chosen_case(scene, method, body, nodes)
    with compiling(errors, "measuring") as report, watching(report):
        costs = cost_table(case)
    if csv is not None:
        write_table(csv, costs)
    if json:
        console.print(costs.to_json(orient="records", force_ascii=False), markup=False, highlight=False)
        return
    turns = costs.attrs["turns"]
    console.print(f"{case.name}, over the whole scene, fastest of {turns}", markup=False, highlight=False)
    console.print(_drawn(costs))
    for what, remark in costs[["what", "how much"]].itertuples(index=False):
        if remark:
            console.print(f"{what}: {remark}", markup=False, highlight=False)


def _drawn(costs: pd.DataFrame) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading, side in (("", "left"), ("µs per step", "right"), ("share", "right")):
        table.add_column(heading, justify=side)  # type: ignore[arg-type]
    for kind, rows in costs.groupby("kind", sort=False):
        table.add_row(HEADINGS[str(kind)], "", "", style="bold")
        for what, cost, share in rows[["what", "µs per step", "share of the step"]].itertuples(index=False):
            table.add_row(f"  {what}", f"{cost:.2f}", f"{100 * share:.1f} %")
    return table
