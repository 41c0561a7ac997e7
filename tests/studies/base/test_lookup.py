import pytest

from studies.base.errors import StudyError
from studies.base.lookup import ALL, lookup
from studies.scene.library import SCENES as ALL_SCENES

SCENES = {"ball_squeeze": 1, "ball_clamped": 2, "liver_press": 3}


def test_a_name_of_the_list_gives_its_item():
    assert lookup("ball_clamped", SCENES, "scene") == 2
    assert lookup("ball_clamped", list(SCENES), "scene") == "ball_clamped"


NAMES = "ball_clamped, ball_squeeze, liver_press"
FIELDS = [f"field_{i:02d}" for i in range(50)]


@pytest.mark.parametrize(
    ("name", "items", "answer"),
    [
        *((t, SCENES, f"did you mean 'ball_squeeze' (known are {NAMES})?") for t in ("bal_squeeze", "BALL_SQUEEZE")),
        ("zzz", SCENES, f"known are {NAMES}"),
        ("q", [], "none are known"),
        ("q", ["lloyd", "cotangent", "lloyd"], "known are cotangent, lloyd"),  # each once
        ("q", FIELDS, f"known are {', '.join(FIELDS[:9])} and 41 more"),
    ],
)
def test_an_unknown_name_is_answered_with_the_nearest_or_with_all(name, items, answer):
    with pytest.raises(StudyError) as problem:
        lookup(name, items, "thing")
    assert str(problem.value) == f"unknown thing {name!r}; {answer}"


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
