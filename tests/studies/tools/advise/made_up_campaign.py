"""A published table of a few recipes whose errors and costs are chosen."""

import json
from pathlib import Path

import pandas as pd

from studies.runs.case import Case
from studies.runs.recipe_text import recipe_text
from studies.runs.recipes import BodyRecipe, QuadraticBody, SurfaceBody, TetrahedralBody
from studies.scene.scene import Scene
from studies.store.machine import machine_id
from studies.store.tables import write_table

PAPER = SurfaceBody(550)
ONE = TetrahedralBody(nodes=300)
EVEN = QuadraticBody(594, mass="heavy")
GRADED = QuadraticBody(994, graded="adaptive", mass="heavy")
FINE = QuadraticBody(1194, graded="adaptive", mass="heavy")
LADDER = {
    PAPER: (-70.0, 17.0, 0.01),
    ONE: (-31.0, 5.0, 0.02),
    EVEN: (2.9, 1.4, 0.2),
    GRADED: (-1.2, 0.8, 0.5),
    FINE: (0.4, 0.3, 2.0),
}
"""Body -> force_end [%], mean_error [%], computing over simulated time [1]."""


def row(scene: Scene, body: BodyRecipe, numbers: tuple[float, float, float], **changes) -> dict[str, object]:
    """A row as a study's table has it; floors of 0.5 and 0.1 %, unless `changes` says otherwise."""
    force, displacement, cost = numbers
    return {
        "scene": scene.name,
        "dt [ms]": 2.0,
        "status": "ok",
        "recipe": recipe_text(Case(scene, body, dt_fraction=0.8)),
        "force_end [%]": force,
        "force_end floor [%]": 0.5,
        "mean_error [%]": displacement,
        "mean_error floor [%]": 0.1,
        "real_time [s/s]": 1.0 / cost,
    } | changes


def rows_of(scene: Scene, ladder=None, **changes) -> list[dict[str, object]]:
    """The ladder in a scene."""
    return [row(scene, body, numbers, **changes) for body, numbers in (ladder or LADDER).items()]


def publish(results: Path, rows: list[dict[str, object]], machine: str | None = None) -> Path:
    """Writes the table below `results`, timed on this machine unless another is named; gives `results`."""
    folder = results / "published"
    (folder / "accuracy").mkdir(parents=True, exist_ok=True)
    write_table(folder / "accuracy" / "accuracy.csv", pd.DataFrame(rows))
    (folder / "machine.json").write_text(json.dumps({"id": machine or machine_id()}), encoding="utf-8")
    return results
