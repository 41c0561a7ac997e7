"""`organbench profile`: where the time of a step goes, what the scene leaves out, and what that saves."""

import warnings
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer
from rich.table import Table

from studies.base.compile_watch import watching
from studies.cli.options import BodyKind, MethodName, SurfaceNodes, chosen_case
from studies.cli.progress import compiling
from studies.cli.terminal import SceneName, console
from studies.metrics.cells import value_cell
from studies.metrics.timing.stage_cost import BUDGET, FRAME, SKIPPED, STAGE, cost_table
from studies.runs.case import Case
from studies.store.tables import write_table

HEADINGS = {STAGE: "stages of a step", SKIPPED: "left out here; what it would cost", FRAME: "Python between two frames"}
MEASUREMENTS = 3
COST, SPREAD, SHARE = "µs per step", "± µs per step", "share of the step"
WHOLE = "whole step"


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
    with compiling("measuring") as report, watching(report):
        costs = measured(case)
    if csv is not None:
        write_table(csv, costs)
    if json:
        console.print(costs.to_json(orient="records", force_ascii=False), markup=False, highlight=False)
        return
    title = f"{case.name}, over the whole scene, mean of {MEASUREMENTS} measurements ± half their range"
    console.print(title, markup=False, highlight=False)
    console.print(_drawn(costs))
    for what, remark in costs[["what", "how much"]].itertuples(index=False):
        if remark:
            console.print(f"{what}: {remark}", markup=False, highlight=False)


def measured(case: Case) -> pd.DataFrame:
    """The mean of several tables of costs, with a column for half their range. A stage that took no time in one of
    them is missing there, and counts as zero."""
    budget = BUDGET / MEASUREMENTS
    tables = [cost_table(case, budget=budget)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the same again
        tables += [cost_table(case, budget=budget) for _ in range(MEASUREMENTS - 1)]
    rows = [table.set_index(["kind", "what"]) for table in sorted(tables, key=len, reverse=True)]
    costs = pd.concat([row[COST] for row in rows], axis=1).fillna(0.0)
    remarks = pd.concat([row["how much"] for row in rows]).groupby(level=[0, 1]).first()
    kinds = {kind: place for place, kind in enumerate(HEADINGS)}
    costs = costs.sort_index(level="kind", key=lambda level: level.map(kinds), sort_remaining=False, kind="stable")
    mean, spread = costs.mean(axis=1), 0.5 * (costs.max(axis=1) - costs.min(axis=1))
    step = float(mean.to_dict()[STAGE, WHOLE])
    columns = {COST: mean, SHARE: mean / step, "how much": remarks.reindex(costs.index), SPREAD: spread}
    return pd.DataFrame(columns).reset_index()


def _drawn(costs: pd.DataFrame) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading, side in (("", "left"), (COST, "right"), ("share", "right")):
        table.add_column(heading, justify=side)  # type: ignore[arg-type]
    for kind, rows in costs.groupby("kind", sort=False):
        table.add_row(HEADINGS[str(kind)], "", "", style="bold")
        for what, cost, spread, share in rows[["what", COST, SPREAD, SHARE]].itertuples(index=False):
            part = f"{100 * share:.1f} %" if cost > spread else "below resolution"
            table.add_row(f"  {what}", value_cell(cost, spread), part)
    return table
