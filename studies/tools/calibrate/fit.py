"""A few numbers of a recipe by least squares, with few runs."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from studies.metrics.judged import Judged, Measured
from studies.metrics.wish import usual_wish
from studies.runs.case import BodyRecipe
from studies.scene.scene import Scene
from studies.tools.calibrate.parameters import Parameter, parameters_of, scaled

DIFFERENCE = 0.05
"""Step of the differences in the logarithm of a parameter: above what contact adds by chance. One-sided, so a parameter
at the bottom of an error is known to half of it, where the error is flat."""
TOLERANCE = 3e-3
MOST = 15
"""Largest number of trial steps."""
LOST = 1e3
"""Residual of a run that ended badly, in goals: the search turns back from it."""
NEAR_BOUND = 1.1
"""A parameter this near to the end of its range, as a factor, ended there: the search stays inside."""

Measure = Callable[[Scene, BodyRecipe], Judged | None]
"""The errors of a recipe in a scene; None where the run ended badly."""


class Fit(NamedTuple):
    """A fitted recipe, and how the search ended."""

    recipe: BodyRecipe
    parameters: tuple[Parameter, ...]
    """Those that were free: never more than the scenes compare errors."""
    converged: bool
    at_bound: tuple[str, ...]
    """Names of parameters that ended at the end of their range."""


def fit(start: BodyRecipe, scenes: Sequence[Scene], measure: Measure) -> Fit:
    """The recipe of least sum of (error/goal)^2 over force_end and mean_error of the scenes.

    Goals are the errors that are usually enough (studies.metrics.wish), or the uncertainty of the reference where that
    is larger: a reference that happens to be finer weighs no more. Searched in the logarithms of the parameters by
    Gauss-Newton steps in a trust region (scipy.optimize.least_squares, "trf").
    """
    count = len(_residuals(start, scenes, measure))
    parameters = parameters_of(start)[:count]

    def residuals(logs: np.ndarray) -> np.ndarray:
        values = _residuals(scaled(start, parameters, np.exp(logs).tolist()), scenes, measure)
        return np.array(values) if len(values) == count else np.full(count, LOST)

    def slopes(logs: np.ndarray) -> np.ndarray:
        here = residuals(logs)
        away = np.where(logs + DIFFERENCE < high, DIFFERENCE, -DIFFERENCE)
        return np.column_stack([(residuals(logs + step) - here) / step.sum() for step in np.diag(away)])

    low, high = (np.log([getattr(parameter, end) for parameter in parameters]) for end in ("lowest", "highest"))
    first = np.zeros(len(parameters))
    limits = {"bounds": (low, high), "xtol": TOLERANCE, "ftol": TOLERANCE, "max_nfev": MOST}
    solution = least_squares(residuals, first, jac=slopes, **limits)  # pyright: ignore[reportArgumentType]
    margin = np.log(NEAR_BOUND)
    at_bound = (solution.x < low + margin) | (solution.x > high - margin)
    names = tuple(parameter.name for parameter, at in zip(parameters, at_bound, strict=True) if at)
    return Fit(scaled(start, parameters, np.exp(solution.x).tolist()), parameters, bool(solution.status > 0), names)


def _residuals(recipe: BodyRecipe, scenes: Sequence[Scene], measure: Measure) -> list[float]:
    """Every error over its goal; none at all where a run ended badly."""
    residuals: list[float] = []
    for scene in scenes:
        errors, wish = measure(scene, recipe), usual_wish(scene)
        if errors is None:
            return []
        residuals += [
            error.value / _scale(error, goal)
            for error, goal in ((errors.force, wish.force), (errors.displacement, wish.displacement))
            if error.known and goal is not None
        ]
    return residuals


def _scale(error: Measured, goal: float) -> float:
    return max(goal, error.uncertainty) if error.uncertainty == error.uncertainty else goal
