"""A page of made-up runs: bodies that move next to a reference, frame times, and names that break a careless page."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from massspring import Free
from studies.catalog import Chart, Study
from studies.exchange.entry import ENTRY, outside
from studies.exchange.judge import unfinished_record
from studies.metrics.run import Run
from studies.metrics.table import study_table
from studies.plots.style.style import svg_copies
from studies.report.page.part import write_part
from studies.report.page.write import write_page
from studies.report.results import draw_charts
from studies.runs.case import Case
from studies.scene.library import BALL_CLAMPED, BALL_SQUEEZE
from studies.store.machine import write_machine
from studies.store.record import Field, Status
from tests.studies.plots.made_up import FRAMES, POINTS, run

NASTY = '</script><img src=x onerror=alert(1)> & "quoted"'
MOMENTS = np.arange(0, FRAMES + 1, 2)
HELD = replace(BALL_CLAMPED, title="A ball of six nodes")
ODD = replace(BALL_CLAMPED, name=NASTY, title=NASTY)
ERRORS = ("volume_worst", "force_end", "mean_error", "shape_error", "shape_volume", "silhouette_error", "min_j")
COLUMNS = (*ERRORS, "step_time", "frame_time", "real_time")


def moving(made: Run) -> Run:
    """The same run with its surface recorded, and its snapshots on the way."""
    share = (MOMENTS / FRAMES)[:, None, None]
    final = made.field("snapshots")[-1] if len(made.field("snapshots")) else POINTS
    surface = (POINTS + share * (final - POINTS))[:, :6].astype(np.float32)
    at = np.array(made.case.scene.checkpoints)[:, None, None] / made.case.scene.duration
    fields = {"surface_frame": MOMENTS, "surface_node": np.arange(6), "surface": surface}
    fields["snapshots"] = POINTS + at * (final - POINTS)
    record = replace(made.record, fields=made.record.fields | {k: Field(v, "1", "x") for k, v in fields.items()})
    return replace(made, record=record, case=made.case.replaced(recorded=("surface",)))


def losses() -> list[Run]:
    """What a study of volumes holds: with and without a replay, not comparable, ended early, with an odd name."""
    return [
        moving(run(HELD, error=0.2)),
        moving(run(HELD, method=Free(), error=0.5)),
        moving(run(BALL_SQUEEZE, error=0.3)),
        moving(run(ODD, error=0.1)),
        run(HELD, "surface", error=0.6),
        run(HELD, "surface", Free(), status=Status.DIVERGED),
        run(BALL_SQUEEZE, "surface", Free(), status=Status.FAILED),
    ]


def rates() -> list[Run]:
    """What a study of frame times holds; the first two are of the other study too."""
    return [run(HELD, error=0.2, frame_ms=1.25), run(HELD, method=Free(), error=0.5, frame_ms=1.0)]


def theirs() -> list[Run]:
    """What other programs handed in: one on the same mesh, the other nothing."""
    made = moving(run(HELD, error=0.05, frame_ms=0.5))
    case = Case(HELD, made.case.body, outside("theirs-half_step"))
    attributes = {ENTRY: "theirs.npz sha256:0", "dt": float("nan"), "dt_limit": float("nan")}
    fields = {name: kept for name, kept in made.record.fields.items() if not name.startswith("surface")}
    record = replace(made.record, key=case.key, attributes=made.record.attributes | attributes, fields=fields)
    skipped = Case(HELD, made.case.body, outside("unable"))
    return [
        replace(made, case=case, record=record),
        Run(skipped, unfinished_record(skipped, Status.SKIPPED, "unable: it knows no caps"), made.reference),
    ]


def study(name: str, runs: list[Run], *charts: tuple[str, str]) -> Study:
    """A study of these runs."""
    drawn = tuple(Chart(file, f"studies.plots.{module}:draw") for file, module in charts)
    return Study(name, f"What is <{name}> & why?", tuple(each.case for each in runs), drawn, COLUMNS)


def made_up_parts(root: Path) -> list[Study]:
    """Keeps the parts of two studies below `root`; entries from outside are in the scene of both."""
    both = {
        "volume_loss": (losses(), (("volume.png", "volume_history"), ("squeeze.png", "squeeze"))),
        "frame_rate": (rates(), (("cost_ratio.png", "cost_ratio"),)),
    }
    studies = []
    for name, (runs, charts) in both.items():
        made = study(name, runs, *charts)
        with svg_copies() as pictures:
            draw_charts(root, made, runs)
        shown = [*runs, *theirs()]
        write_part(root, made, shown, study_table(shown, COLUMNS), pictures)
        studies.append(made)
    write_machine(root / "machine.json")
    return studies


def made_up_page(root: Path) -> Path:
    """report.html of both."""
    path, remarks = write_page(root, made_up_parts(root))
    assert path is not None and remarks == []
    return path
