"""Errors of recipes by formula, and a calibration that was never run."""

from studies.metrics.judged import UNKNOWN, Judged, Measured
from studies.runs.case import BodyRecipe, Case
from studies.scene.scene import Scene
from studies.tools.calibrate.stored import Calibration, SceneErrors, Trial
from studies.tools.calibrate.verdict import Compared, Verdict

UNCERTAINTY = 0.5


def judged(scene: Scene, recipe: BodyRecipe, force: float | None, displacement: float | None = None) -> Judged:
    """Errors [%] with an uncertainty of half a percent; None: not compared."""
    errors = (UNKNOWN if value is None else Measured(value, UNCERTAINTY) for value in (force, displacement))
    return Judged(Case(scene, recipe), *errors)


def made_up(verdict: Verdict = Verdict.HOLDS, **changes) -> Calibration:
    """Of a liver: fitted on the press and judged on the probe, in which the fitted body is lost."""
    rows = (
        SceneErrors("liver_press", True, Compared(-25.8, 0.04, 1.7), Compared(3.8, 3.8, 1.4)),
        SceneErrors("liver_probe", False, Compared(-33.2, None, 1.0), None),
    )
    values = {
        "organ": "liver",
        "start": BodyRecipe("surface", 300),
        "recipe": BodyRecipe("surface", 300, stiffness=1.626, weights=(1.0, 0.5, 0.4388, 1.0)),
        "parameters": {"stiffness": 1.626, "inner weight": 0.4388},
        "fitted": ("liver_press",),
        "verdict": verdict,
        "trials": (Trial({"stiffness": 2.655}, rows, Verdict.MEMORISES, None, ("a remark",)),),
        "fingerprint": "0badcafe",
        "date": "2026-11-22",
        "versions": {"python": "CPython 3.11", "pypardiso": None},
    }
    return Calibration(**(values | changes))
