import pytest

from studies.base.errors import StudyError
from studies.base.lookup import lookup

SCENES = {"ball_squeeze": 1, "ball_clamped": 2, "liver_press": 3}


def test_a_known_name_gives_its_item():
    assert lookup("ball_clamped", SCENES, "scene") == 2
    assert lookup("ball_clamped", list(SCENES), "scene") == "ball_clamped"


@pytest.mark.parametrize("typo", ["bal_squeeze", "BALL_SQUEEZE", "ball-squeeze", "ballsqueeze"])
def test_a_typo_is_answered_with_the_nearest_name(typo):
    with pytest.raises(StudyError) as problem:
        lookup(typo, SCENES, "scene")
    known = "ball_clamped, ball_squeeze, liver_press"
    assert str(problem.value) == f"unknown scene {typo!r}; did you mean 'ball_squeeze' (known are {known})?"


def test_nothing_near_suggests_nothing():
    with pytest.raises(StudyError) as problem:
        lookup("zzz", SCENES, "scene")
    assert str(problem.value) == "unknown scene 'zzz'; known are ball_clamped, ball_squeeze, liver_press"


def test_many_names_are_cut_and_none_are_said():
    with pytest.raises(StudyError, match=r"field_19 and 30 more$"):
        lookup("q", [f"field_{i:02d}" for i in range(50)], "field")
    with pytest.raises(StudyError, match="unknown field 'q'; none are known"):
        lookup("q", [], "field")
