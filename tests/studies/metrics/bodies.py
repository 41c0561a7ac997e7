"""Runs of real bodies at rest, whose shape is judged without a simulation."""

from dataclasses import replace

import numpy as np

from massspring import Body
from studies.metrics.run import Run
from studies.runs.case import Case
from studies.runs.recipes import BODIES, BodyRecipe
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.scene import Organ, Scene
from tests.studies import made_up_run


def rest_run(scene: Scene, recipe: BodyRecipe, body: Body, rest: np.ndarray | None = None) -> Run:
    """A run of `body` that stays where it is, at `rest` (n, 3) [m] in place of its own."""
    points = body.rest if rest is None else rest
    values = {
        "rest": points,
        "snapshots": points[None],
        "mass": body.mass,
        "triangles": body.triangles,
        "tetrahedra": body.tetrahedra,
    }
    made = made_up_run.run(values=values, reference=None)
    return replace(made, case=Case(scene, recipe))


def ball_run(body: Body, rest: np.ndarray | None = None, kind: str = "quadratic", radius: float = 0.05) -> Run:
    """Such a run whose organ is a ball."""
    scene = replace(BALL_CLAMPED, organ=Organ("ball", {"radius": radius}))
    return rest_run(scene, BODIES[kind](), body, rest)
