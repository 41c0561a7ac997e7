"""A scene and a recipe's text of a table give the case again."""

import json

import pytest

from massspring import ImplicitVolume
from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.runs.case import Case
from studies.runs.recipe_text import case_of_recipe, recipe_text
from studies.runs.recipes import QuadraticBody
from studies.scene.library.liver_press import LIVER_PRESS


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_every_case_of_the_catalogue_comes_back(study):
    for case in study.cases:
        assert case_of_recipe(case.scene, recipe_text(case)) == case.replaced(timed=False, recorded=())


def test_only_what_was_chosen_is_named():
    assert recipe_text(Case(LIVER_PRESS)) == "{}"
    # As published tables have it: without a setting that came later and has its default.
    chosen = recipe_text(Case(LIVER_PRESS, method=ImplicitVolume(most_iterations=9)))
    assert json.loads(chosen)["method"]["settings"] == {"tolerance": 1e-5, "most_iterations": 9}
    case = Case(LIVER_PRESS, QuadraticBody(794), dt_fraction=0.8)
    assert recipe_text(case) == '{"body": {"kind": "quadratic", "nodes": 794}, "dt_fraction": 0.8}'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is not a recipe of a case"),
        ("[1]", "must be a JSON object"),
        ('{"body": {"nodes": 300, "shape": "cube"}}', "the text is not a stored case"),
        ('{"steps": 3}', "unknown setting steps"),
        ('{"body": {"kind": "cubic"}}', "the text is not a stored case"),
    ],
)
def test_what_is_no_recipe_is_one_sentence(text, message):
    with pytest.raises(StudyError, match=message):
        case_of_recipe(LIVER_PRESS, text)
