import pytest

from studies.base.errors import StudyError
from studies.base.lookup import ALL, lookup
from studies.scene.library import SCENES as ALL_SCENES

SCENES = {"ball_squeeze": 1, "ball_clamped": 2, "liver_press": 3}


def test_a_name_of_the_list_gives_its_item():
    assert lookup("ball_clamped", SCENES, "scene") == 2
    assert lookup("ball_clamped", list(SCENES), "scene") == "ball_clamped"


@pytest.mark.parametrize("typo", ["bal_squeeze", "BALL_SQUEEZE", "ball-squeeze", "ballsqueeze"])
def test_a_typo_is_answered_with_the_nearest_name(typo):
    with pytest.raises(StudyError) as problem:
        lookup(typo, SCENES, "scene")
    names = "ball_clamped, ball_squeeze, liver_press"
    assert str(problem.value) == f"unknown scene {typo!r}; did you mean 'ball_squeeze' (known are {names})?"


def test_nothing_near_suggests_nothing():
    with pytest.raises(StudyError) as problem:
        lookup("zzz", SCENES, "scene")
    assert str(problem.value) == "unknown scene 'zzz'; known are ball_clamped, ball_squeeze, liver_press"


def test_a_long_list_is_cut_and_an_empty_one_is_named_as_such():
    with pytest.raises(StudyError, match=r"known are field_00, .*, field_08 and 41 more$") as problem:
        lookup("q", [f"field_{i:02d}" for i in range(50)], "field")
    assert len(str(problem.value)) < 140
    with pytest.raises(StudyError, match="unknown field 'q'; none are known"):
        lookup("q", [], "field")


@pytest.mark.parametrize("typo", ["ball_squeze", "zzz"])
def test_of_many_names_the_command_that_shows_all_is_named(typo):
    nearest = "did you mean 'ball_squeeze' (" if typo != "zzz" else ""
    with pytest.raises(StudyError) as problem:
        lookup(typo, [scene.name for scene in ALL_SCENES], "scene")
    assert f"{nearest}`organbench list scenes` shows all" in str(problem.value) and len(str(problem.value)) < 100


def test_every_command_that_a_list_names_is_one(organbench):
    for command in ALL.values():
        code, out, err = organbench(*command.split()[1:])
        assert code == 0 and len(out.splitlines()) > 3, err


def test_a_name_is_listed_once():
    with pytest.raises(StudyError, match=r"known are cotangent, lloyd$"):
        lookup("q", ["lloyd", "cotangent", "lloyd"], "stiffness law")
