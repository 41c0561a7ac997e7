"""`organbench judge`: what another program computed, judged as our own runs are."""

from pathlib import Path
from typing import Annotated

import typer

from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.cli.terminal import Results, SceneName, busy, say, warn
from studies.exchange.description import judged_metrics
from studies.exchange.entry import entry_path, run_of_entry
from studies.exchange.judge import entry_record
from studies.exchange.league import FOLDER
from studies.exchange.league.entry_file import check_entry, check_mesh_here, judged_file, read_entry_file
from studies.exchange.meshes import NODES
from studies.metrics.cells import UNRESOLVED_NOTE, plain, value_cell
from studies.metrics.judged import FORCE
from studies.metrics.run import Run
from studies.reference.load import Reference, reference_for
from studies.scene.quantities import ALWAYS
from studies.scene.scene import Scene
from studies.store.record import write_record
from studies.sweep.find_scene import find_scene

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
    force: Annotated[Path | None, typer.Option(help="CSV file with the columns t [s] and force [N]")] = None,
    seconds: Annotated[float | None, typer.Option(help="computing time for one simulated second")] = None,
    nodes: Annotated[int, typer.Option(help="vertices on the outer surface, as in the exported mesh")] = NODES,
    results: Results = Path("results"),
) -> None:
    """Judge the results of another program like our own: positions, forces, times. Keep them with our results."""
    entry = read_entry_file(file) if file.suffix.lower() == ".json" else None
    if entry is not None:
        if name or force is not None or seconds is not None:
            raise StudyError(f"{file.name} says all about the entry itself; leave out --name, --force and --seconds")
        check_entry(entry, scene)
    chosen_scene = find_scene(scene)
    with busy(f"judging {file.name}"):
        if entry is None:
            record = entry_record(chosen_scene, file, name or file.stem, nodes, force, seconds)
        else:
            check_mesh_here(entry, chosen_scene)
            record = judged_file(chosen_scene, entry, file.parent)
        run = run_of_entry(record, reference_of(results, chosen_scene))
    path = entry_path(results if entry is None else results / FOLDER, run.case)
    replaced = path.is_file()
    write_record(path, record)
    mesh = "the curved mesh" if run.case.body.kind == "quadratic" else "the straight mesh"
    steps = record.attributes["frames"]
    say(f"{run.case.method.name}: {record.status}, {record.attributes['nodes']} nodes of {mesh}, {steps} steps")
    for line in lines_of(run):
        say(line)
    warn(hints_of(run))
    if replaced:
        warn([f"it replaces an entry named {run.case.method.name} on the same mesh"])
    names = [study.name for study in STUDIES if chosen_scene.name in [each.name for each in study.scenes]]
    command = "report" if entry is not None else f"table {names[-1]}" if names else ""
    shown = f", shown next to our methods by `organbench {command}`" if command else ""
    say(f"stored in {path}{shown}")


def reference_of(results: Path, scene: Scene) -> Reference | None:
    """The stored reference of a scene; without one, a warning: then no errors are judged."""
    try:
        return reference_for(results, scene)
    except StudyError as problem:
        warn([f"errors are not judged, because the reference is missing: {problem}"])
        return None


def hints_of(run: Run) -> list[str]:
    """Warnings of probable mistakes in a result that can be judged."""
    hints = [text] if (text := str(run.record.attributes["warnings"])) else []
    error = FORCE(run)
    if error < REVERSED:
        hints.append(
            f"the force has the wrong sign: reversed, its error is {plain(2 * REVERSED - error, '+')} % and not "
            f"{plain(error)} %; a press is positive (force in scene.json)"
        )
    return hints


def lines_of(run: Run) -> list[str]:
    """Each metric with its value and uncertainty."""
    lines, marked = [], False
    for metric in judged_metrics(run.case.scene):
        value = metric(run)
        if value != value:
            continue
        uncertainty = metric.uncertainty(run) if metric.quantity not in ALWAYS else float("nan")
        unresolved = metric.unresolved(run)
        marked |= unresolved
        shown = value_cell(value, uncertainty, signed=metric.better == "-", unresolved=unresolved)
        lines.append(f"  {metric.name:18} {shown} {metric.unit}".removesuffix(" 1"))
    return [*lines, UNRESOLVED_NOTE] if marked else lines
