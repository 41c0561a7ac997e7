"""The recipe of a case: all settings except the scene, as a short text in tables from which the case can be made
again."""

import json

from studies.base.errors import StudyError
from studies.runs.case import Case, case_from_json, case_to_dict
from studies.runs.recipes import BodyRecipe, TetrahedralBody
from studies.scene.scene import Scene

UNNAMED = {"recovers": False, "law": "neo_hookean"}
"""Settings of methods that a recipe names only where they differ from this, so that published tables keep their
texts."""


def recipe_text(case: Case) -> str:
    """JSON of the settings that differ from those of `Case(scene)`: '{"body": {"kind": "quadratic", "nodes": 794}}'.

    Of a method all settings. Additional recorded fields are left out, since they change no number of a table."""
    usual, given = case_to_dict(Case(case.scene)), case_to_dict(case.replaced(recorded=()))
    differing = {name: value for name, value in given.items() if value != usual.get(name)}
    if "body" in differing:
        differing["body"] = case.body.chosen
    if "method" in differing:
        settings = differing["method"]["settings"].items()
        differing["method"]["settings"] = {k: v for k, v in settings if k not in UNNAMED or v != UNNAMED[k]}
    return json.dumps(differing)


def case_of_recipe(scene: Scene, text: str) -> Case:
    """The case with recipe `text` in a scene. Raises StudyError if `text` is not a recipe."""
    try:
        chosen = json.loads(text)
    except (TypeError, ValueError) as error:
        raise StudyError(f"{str(text)[:60]!r} is not a recipe of a case ({error})") from error
    if not isinstance(chosen, dict):
        raise StudyError(f"{text[:60]!r} is not a recipe of a case; it must be a JSON object")
    whole = case_to_dict(Case(scene)) | chosen
    if isinstance(whole["body"], dict):
        whole["body"] = {"kind": TetrahedralBody.kind} | whole["body"]
    return case_from_json(json.dumps(whole))


def body_words(body: BodyRecipe) -> str:
    """Name of a body in tables: "graded quadratic, masses by stiffness, 794"."""
    law = "" if body.law in ("", "van_gelder", "cotangent") else f", {body.law}"
    return f"{body.series}{law}, {body.nodes}"
