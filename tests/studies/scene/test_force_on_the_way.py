"""The share of drag in the error of the force along the path: the table of docs/accuracy.md, and its remedy."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from massspring import Trajectory
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import solve
from studies.runs.case import Case
from studies.runs.recipes import QuadraticBody
from studies.runs.run import measure
from studies.scene.library import LIVER_PRESS, LIVER_PROBE, STOMACH_PRESS, STOMACH_PROBE
from studies.scene.scene import FEWEST_UNKNOWNS, Scene
from studies.store.record import Record, read_record

ROOT = Path(__file__).parents[3]
SCENES = (LIVER_PRESS, LIVER_PROBE, STOMACH_PRESS, STOMACH_PROBE)
SIZE = 794
MORE = 8.0
"""Damping [1/s] that the scenes had."""
EQUILIBRIA = {"liver_press": (-2.7, -2.4, 0.4, 0.8, 1.2), "liver_probe": (4.8, -1.5, 5.0, 1.0, -2.1)}
"""Scene -> what the force is above the reference at each checkpoint when nothing drags [%]."""


def published_rows() -> dict[str, list[float]]:
    """Scene -> the numbers of its row."""
    page = (ROOT / "docs/accuracy.md").read_text(encoding="utf-8")
    part = page.split("## Force along the path\n")[1].split("\n## ")[0]
    rows = re.findall(r"^\| (\w+) \| ([-−+\d. |]+) \|$", part, re.M)
    return {name: [float(cell.replace("−", "-")) for cell in cells.split(" | ")] for name, cells in rows}


def graded(scene: Scene) -> bool:
    """Whether its row is of the graded body."""
    return scene.name.startswith("liver")


def slower(scene: Scene, times: int) -> Scene:
    """The same obstacles on the same way in so many times the time."""
    moved = tuple(
        replace(o, path=Trajectory(tuple(times * t for t in o.path.times), o.path.displacements))
        for o in scene.obstacles
    )
    checkpoints = tuple(times * t for t in scene.checkpoints)
    return replace(
        scene,
        duration=times * scene.duration,
        frames=times * scene.frames,
        checkpoints=checkpoints,
        obstacles=moved,
    )


def run(scene: Scene, damping: float, times: int = 1) -> tuple[np.ndarray, Record]:
    """The force at the checkpoints [N], and the record."""
    scene = replace(slower(scene, times), damping=damping)
    body = QuadraticBody(SIZE, graded=graded(scene), mass="stiffness")
    record = measure(Case(scene, body, dt_fraction=0.8))
    force = scene.output_force(*(record.fields[name].values for name in ("contact_force", "held_force")))
    t = record.fields["t"].values
    return force[[int(np.argmin(np.abs(t - at))) for at in scene.checkpoints]], record


def coarsest(scene: Scene, root: Path) -> np.ndarray:
    """The force at the checkpoints on the coarsest mesh of the reference's family [N]."""
    assert scene.reference is not None
    alone = replace(scene, reference=replace(scene.reference, most=FEWEST_UNKNOWNS, variants=()))
    fields = read_record(solve(root, ReferenceSolve(alone))).fields
    return scene.output_force(fields["contact_force"].values, fields["held_force"].values)


def apart(force: np.ndarray, truth: np.ndarray) -> float:
    """Of all checkpoints [%]."""
    return 100 * float(np.linalg.norm(force - truth) / np.linalg.norm(truth))


@pytest.mark.campaign
@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_errors_and_drag_are_what_the_table_says(scene, mesh_cache, tmp_path):
    """Minutes for each scene: a reference, and runs of eight presses' time."""
    truth, still = coarsest(scene, tmp_path), run(scene, 1.0, 4)[0]
    dragged, slow, (calm, record) = run(scene, MORE)[0], run(scene, MORE, 2)[0], run(scene, scene.damping)
    if scene.name in EQUILIBRIA:
        assert 100 * (still / truth - 1) == pytest.approx(EQUILIBRIA[scene.name], abs=0.2)
    row = [apart(force, truth) for force in (dragged, calm, still)]
    row += [apart(force, still) for force in (dragged, slow, calm)]
    row += [100 * float(calm[-1] / dragged[-1] - 1), 100 * float(record.attributes["sway"])]
    assert row == pytest.approx(published_rows()[scene.name], abs=0.1)
