"""Bounds for a scene that was never run: the worst that was measured in the scenes of its kind."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Literal

from studies.base.errors import DoesNotApply, StudyError
from studies.catalog.accuracy import usual_mass
from studies.metrics.judged import UNKNOWN, Judged, Measured
from studies.runs.case import Case
from studies.runs.quadratic import check_masses
from studies.runs.recipe_text import recipe_text
from studies.runs.recipes import QuadraticBody
from studies.scene.inertia import why_inertia_matters
from studies.scene.kind import kind_of
from studies.scene.scene import Scene

NUMBERS = ("force", "displacement", "cost", "shape", "shape_volume")
"""Of Judged: what is measured."""


def same_kind(scene: Scene, scenes: Iterable[Scene]) -> list[Scene]:
    """Those of `scenes` that are as hollow as `scene`, loaded in the same way, and held if it is."""
    kind = kind_of(scene), bool(scene.held)
    return [other for other in scenes if (kind_of(other), bool(other.held)) == kind]


def worst_of(scene: Scene, groups: Sequence[Sequence[Judged]]) -> list[Judged]:
    """The recipes that ended well in all `groups`, one for each scene, as cases of `scene` with their largest errors
    and costs; without those that the scene refuses. The step is not known before the body is made. Raises StudyError
    where none is left.

    For another organ only quadratic bodies with smaller elements where the scene needs them: on random scenes 13 of 19
    with elements of one size missed the target by more than the reference's uncertainty, of 22 adaptive ones 2, which
    said so (docs/population.md). Masses by stiffness and heavy ones end alike, and are those that suit `scene`.
    """
    usual = usual_mass(scene)
    by_recipe = [{recipe_text(_in_scene(scene, one.case, usual)): one for one in group} for group in groups]
    common = [text for text in by_recipe[0] if all(text in group for group in by_recipe)]
    recipes = []
    for text in common:
        same = [group[text] for group in by_recipe]
        case = _in_scene(scene, same[0].case, usual)
        other_organ = any(one.case.scene.organ != scene.organ for one in same)
        if _refused(scene, case) or (other_organ and not case.body.graded):
            continue
        force, displacement, cost, shape, volume = (_largest([getattr(one, name) for one in same]) for name in NUMBERS)
        meshes = tuple(mesh for one in same for mesh in one.members)
        disturbed = next((one.disturbed for one in same if one.disturbed), "")
        worst = Judged(case, force, displacement, cost, disturbed=disturbed, shape=shape, shape_volume=volume)
        recipes.append(replace(worst, members=meshes))
    if not recipes:
        why = why_inertia_matters(scene) or "they share no body with smaller elements where a scene needs them"
        raise StudyError(
            f"no results apply to scene '{scene.name}': those of scenes of its kind ({kind_of(scene)}) do not hold for "
            f"it: {why}; `organbench run FILE.py` runs it on two meshes"
        )
    return recipes


def _in_scene(scene: Scene, case: Case, usual: Literal["lumped", "stiffness", "heavy"]) -> Case:
    """The recipe of a case in another scene, with its `usual` masses where neither has those of the tissue."""
    body = case.body
    if isinstance(body, QuadraticBody) and "lumped" not in (body.mass, usual):
        body = replace(body, mass=usual)
    return case.replaced(scene=scene, body=body)


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
