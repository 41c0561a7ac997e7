"""`organbench judge`: what another program computed, judged as our own runs are."""

from pathlib import Path
from typing import Annotated

import typer

from studies.cli.terminal import Results, SceneName, busy, say, warn
from studies.exchange.description import judged_metrics
from studies.exchange.entry import entry_files, sides_of
from studies.exchange.judge import judge as judged
from studies.exchange.judge import judged_path
from studies.exchange.league import LEAGUE, check_entry, read_entry_file
from studies.exchange.meshes import NODES
from studies.metrics.cells import MISSED_MARK, MISSED_NOTE, UNRESOLVED_NOTE, plain, value_cell
from studies.metrics.judged import FORCE
from studies.metrics.metric import PERCENT
from studies.metrics.run import Run
from studies.metrics.wish import missed
from studies.report.results import report_entry
from studies.scene.quantities import ALWAYS
from studies.store.ledger import Ledger
from studies.sweep.find_scene import find_scene

UNITS, NEAR = {"mN": 1e-3, "kN": 1e3}, 50.0
"""Size of a wrong unit of force [N], and |force_end| [%] below which the force is in this unit."""
REVERSED = -100.0
"""force_end [%] below which a force of the other sign fits better."""


def judge(
    scene: SceneName,
    file: Annotated[
        Path,
        typer.Argument(
            help="npz, CSV, VTKHDF or PVD file, a folder of VTU files, a pattern, or an entry of the league (JSON)"
        ),
    ],
    name: Annotated[str, typer.Option(help="name of the entry in tables and charts; default: the file's name")] = "",
    force: Annotated[Path | None, typer.Option(help="CSV file with the columns t \\[s] and force \\[N]")] = None,
    seconds: Annotated[float | None, typer.Option(help="computing time for one simulated second")] = None,
    nodes: Annotated[int, typer.Option(help="vertices on the outer surface, as in the exported mesh")] = NODES,
    results: Results = Path("results"),
) -> None:
    """Judge the results of another program like our own: positions, forces, times. Write a page that shows them."""
    if file.suffix.lower() == ".json":
        check_entry(read_entry_file(file), scene)  # a scene that is held back is no scene here
    chosen_scene = find_scene(scene)
    before = {*entry_files(results), *entry_files(results / LEAGUE)}
    with busy(f"judging {file.name}"):
        run = judged(chosen_scene, file, results, name=name, nodes=nodes, force=force, seconds=seconds)
    attributes, path = run.record.attributes, judged_path(results, run)
    if run.record.fields:
        size = f"{attributes['nodes']} nodes of the {sides_of(run.case)} mesh, {attributes['frames']} steps"
        say(f"{run.case.method.name}: {run.record.status}, {size}")
        for line in lines_of(run):
            say(line)
        warn(hints_of(run))
    else:
        say(f"{run.case.method.name}: {run.record.status}, {run.record.message}")
    if path in before:
        warn([f"it replaces an entry named {run.case.method.name} on the same mesh"])
    say(f"stored in {path}")
    with busy("drawing the page"):
        page, remarks = report_entry(Ledger(results), run, chosen_scene)
    warn(remarks)
    say(f"{page}: next to {'our methods' if run.reference is None else 'the reference and our methods'}")


def hints_of(run: Run) -> list[str]:
    hints = [text] if (text := str(run.record.attributes["warnings"])) else []
    error = FORCE(run)
    for unit, factor in UNITS.items():
        if abs(in_unit := PERCENT * ((1.0 + error / PERCENT) * factor - 1.0)) < NEAR:
            hints.append(f"is the force in {unit}? Then its error is {plain(in_unit, '+')} %; give it in N")
    if error < REVERSED:
        hints.append(
            f"the force has the wrong sign: reversed, its error is {plain(2 * REVERSED - error, '+')} % and not "
            f"{plain(error)} %; a press is positive (force in scene.json)"
        )
    return hints


def lines_of(run: Run) -> list[str]:
    lines, marked, metrics = [], False, judged_metrics(run.case.scene)
    misses = missed(run.case.scene, {metric.name: metric(run) for metric in metrics})
    for metric in metrics:
        value = metric(run)
        if value != value:
            continue
        uncertainty = metric.uncertainty(run) if metric.quantity not in ALWAYS else float("nan")
        unresolved = metric.unresolved(run)
        marked |= unresolved
        shown = value_cell(value, uncertainty, signed=metric.better == "-", unresolved=unresolved)
        miss = f" {MISSED_MARK}" if metric.name in misses else ""
        lines.append(f"  {metric.name:18} {shown} {metric.unit}".removesuffix(" 1") + miss)
    return lines + [UNRESOLVED_NOTE] * marked + [MISSED_NOTE] * bool(misses)
