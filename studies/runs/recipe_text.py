"""The recipe of a case: all settings except the scene, as a short text in tables from which the case can be made
again."""

import json
from typing import Any

from studies.base.errors import StudyError
from studies.runs.case import BodyRecipe, Case, case_from_json, case_to_dict
from studies.scene.scene import Scene


def recipe_text(case: Case) -> str:
    """JSON of the settings that differ from those of `Case(scene)`: '{"body": {"kind": "quadratic", "nodes": 794}}'.

    Additional recorded fields are left out, since they change no number of a table."""
    usual, given = _parts(Case(case.scene)), _parts(case.replaced(recorded=()))
    differing = {name: value for name, value in given.items() if value != usual.get(name)}
    return json.dumps({name: _chosen(value, usual.get(name)) for name, value in differing.items()})


def case_of_recipe(scene: Scene, text: str) -> Case:
    """The case with recipe `text` in a scene. Raises StudyError if `text` is not a recipe."""
    try:
        chosen = json.loads(text)
    except (TypeError, ValueError) as error:
        raise StudyError(f"{str(text)[:60]!r} is not a recipe of a case ({error})") from error
    if not isinstance(chosen, dict):
        raise StudyError(f"{text[:60]!r} is not a recipe of a case; it must be a JSON object")
    whole = case_to_dict(Case(scene))
    for name, value in chosen.items():
        mixes = name == "body" and isinstance(value, dict)
        whole[name] = {**whole[name], **value} if mixes else value
    return case_from_json(json.dumps(whole))


def body_words(body: BodyRecipe) -> str:
    """Name of a body in tables: "graded quadratic, masses by stiffness, 794"."""
    law = "" if body.law in ("van_gelder", "cotangent") else f", {body.law}"
    return f"{body.series}{law}, {body.nodes}"


def _parts(case: Case) -> dict[str, Any]:
    return {name: value for name, value in case_to_dict(case).items() if name != "scene"}


def _chosen(value: Any, usual: Any) -> Any:
    """Settings that differ from `usual`; of a body field by field, of a method all of them."""
    if not isinstance(value, dict) or "name" in value:
        return value
    return {name: item for name, item in value.items() if item != usual.get(name)}
