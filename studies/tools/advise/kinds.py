"""Bounds for a scene that was never run: the worst that was measured in the scenes of its kind."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from studies.base.errors import DoesNotApply
from studies.metrics.judged import UNKNOWN, Judged, Measured
from studies.runs.case import Case
from studies.runs.quadratic import check_masses
from studies.runs.recipe_text import recipe_text
from studies.scene.kind import kind_of
from studies.scene.scene import Scene

NUMBERS = ("force", "displacement", "cost", "shape", "shape_volume")
"""Of Judged: what is measured."""


def same_kind(scene: Scene, scenes: Iterable[Scene]) -> list[Scene]:
    """Those of `scenes` that are as hollow as `scene` and loaded in the same way."""
    kind = kind_of(scene)
    return [other for other in scenes if kind_of(other) == kind]


def worst_of(scene: Scene, groups: Sequence[Sequence[Judged]]) -> list[Judged]:
    """The recipes that ended well in all `groups`, one for each scene, as cases of `scene` with their largest errors
    and costs; without those that the scene refuses. The step is not known before the body is made.

    Even quadratic bodies do not stand for another organ: on random scenes 13 of 19 of them missed the target by more
    than the reference's uncertainty, of 22 adaptive ones 2, which said so (docs/population.md).
    """
    by_recipe = [{recipe_text(one.case): one for one in group} for group in groups]
    common = [text for text in by_recipe[0] if all(text in group for group in by_recipe)]
    recipes = []
    for text in common:
        same = [group[text] for group in by_recipe]
        case = same[0].case.replaced(scene=scene)
        other_organ = any(one.case.scene.organ != scene.organ for one in same)
        if _refused(scene, case) or (other_organ and case.body.kind == "quadratic" and not case.body.graded):
            continue
        force, displacement, cost, shape, volume = (_largest([getattr(one, name) for one in same]) for name in NUMBERS)
        meshes = tuple(mesh for one in same for mesh in one.members)
        disturbed = next((one.disturbed for one in same if one.disturbed), "")
        worst = Judged(case, force, displacement, cost, disturbed=disturbed, shape=shape, shape_volume=volume)
        recipes.append(replace(worst, members=meshes))
    return recipes


def _largest(values: Sequence[Measured]) -> Measured:
    """The one that is farthest from zero, with the largest uncertainty of all; unknown where none is known."""
    numbers = [value for value in values if value.known]
    if not numbers:
        return UNKNOWN
    uncertain = [value.uncertainty for value in numbers if value.uncertainty == value.uncertainty]
    return Measured(max(numbers, key=lambda value: abs(value.value)).value, max(uncertain, default=float("nan")))


def _refused(scene: Scene, case: Case) -> bool:
    try:
        check_masses(scene, case.body)
    except DoesNotApply:
        return True
    return scene.skip(case.method.name) is not None
