"""The numbers of a recipe that a calibration may change: one of a filled body, two of the paper's."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from massspring.body.build import SURFACE_WEIGHTS
from massspring.body.springs import SpringKind
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.runs.case import BodyRecipe

DIGITS = 4
"""Significant digits of a fitted value: the recipe is the key of a record, and no error needs more."""
INNER = list(SURFACE_WEIGHTS).index(SpringKind.INNER)
KINDS = ("tetrahedral", "surface")
FEW_VOLUMES = ("scene", "whole")


@dataclass(frozen=True)
class Parameter:
    """A positive number of a recipe."""

    name: str
    read: Callable[[BodyRecipe], float]
    written: Callable[[BodyRecipe, float], BodyRecipe]
    """The recipe with another value."""
    lowest: float
    highest: float
    """Factors on the first value: the range of the search."""


def weights_of(recipe: BodyRecipe) -> tuple[float, ...]:
    """Relative stiffness of structural, bending, inner and axial springs of a surface body."""
    return recipe.weights or tuple(SURFACE_WEIGHTS.values())


def _with_inner(recipe: BodyRecipe, value: float) -> BodyRecipe:
    structural, bending, _, axial = weights_of(recipe)
    return replace(recipe, weights=(structural, bending, value, axial))


STIFFNESS = Parameter(
    "stiffness", lambda recipe: recipe.stiffness, lambda recipe, value: replace(recipe, stiffness=value), 0.01, 100.0
)
"""On every spring: forces of a slowly moved body are proportional to it, displacements do not depend on it."""
INNER_WEIGHT = Parameter("inner weight", lambda recipe: weights_of(recipe)[INNER], _with_inner, 0.02, 50.0)
"""Of the springs to the axis, relative to those on the surface: the ratio of weights that changes the displacement most
(docs/accuracy.md). The other ratios have the same effect, and less of it."""


def parameters_of(recipe: BodyRecipe) -> tuple[Parameter, ...]:
    """What is fitted of a body, the most important first. Raises StudyError for a body that is not calibrated."""
    kind = lookup(recipe.kind, KINDS, "body for a calibration")
    if kind == "tetrahedral" and recipe.volumes not in FEW_VOLUMES:
        raise StudyError(
            f"a tetrahedral body with volumes '{recipe.volumes}' is not calibrated; more volumes are its way to the "
            f"right force, leave them at 'scene' or 'whole'"
        )
    return (STIFFNESS, INNER_WEIGHT) if kind == "surface" else (STIFFNESS,)


def scaled(recipe: BodyRecipe, parameters: Sequence[Parameter], factors: Sequence[float]) -> BodyRecipe:
    """The recipe with each parameter times its factor, to DIGITS significant digits."""
    for parameter, factor in zip(parameters, factors, strict=True):
        if factor != 1.0:
            recipe = parameter.written(recipe, float(f"{parameter.read(recipe) * factor:.{DIGITS}g}"))
    return recipe
