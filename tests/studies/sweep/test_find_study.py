"""Study files of a user: what they define, and one sentence with the line at fault for what is wrong."""

import pytest

from studies.base.errors import StudyError
from studies.sweep.find_scene import find_scene
from studies.sweep.find_study import find_study
from tests.studies.tiny import SQUEEZE

TOP = (
    "from dataclasses import dataclass; from massspring import Free\n"
    "from studies import Chart, QuadraticBody, SurfaceBody\nfrom tests.studies.tiny import *\n"
)
SCENE = "SCENE = replace(SQUEEZE, name='alone')\n"
STUDY = "STUDY = tiny_study(cases=(tiny_case(recorded=('surface',)),))\n"
SEVERAL = "STUDY = tiny_study(cases=(tiny_case(), tiny_case(scene=replace(SQUEEZE, name='other'))))\n"


def study(words: str) -> str:
    return f"{TOP}STUDY = tiny_study({words})\n"


def case(words: str) -> str:
    return study(f"cases=(tiny_case({words}),)")


BROKEN = {
    "defines neither STUDY nor SCENE": "CASES = 3\n",
    "is str; give a Study, as `from studies import Study`": "STUDY = 'volume_loss'\n",
    "SyntaxError in line 2: '(' was never closed": "import os\nSTUDY = (\n",
    "ModuleNotFoundError in line 2: No module named 'massspringg'": "\nimport massspringg\n",
    "NameError in line 2: name 'nothing' is not defined": "def f():\n    return nothing\nf()\n",
    "TypeError in line 4": f"{TOP}STUDY = Case(SQUEEZE, dtt=1)\n",
    "SystemExit in line 2: 3": "import sys\nsys.exit(3)\n",
    "BaseException in line 1; correct it and run again": "raise BaseException\n",
    "in line 2: the plane normal is (0, 0, 0)": "from massspring import Plane\nPlane((0, 0, 0), (0, 0, 0))\n",
    "dt is 0.0 s; it must be": case("dt=0.0"),
    "dt is -1 s; it must be": case("dt=-1"),
    "in line 4: the method is Free": case("method=Free"),
    "method 'free' is one of the project's own; give yours another name": f"{TOP}@dataclass(frozen=True)\n"
    "class Mine(Free):\n    pass\n\nSTUDY = tiny_study(cases=(tiny_case(method=Mine()),))\n",
    "in line 4: a case needs a BodyRecipe, not None": study("cases=(Case(SQUEEZE, None),)"),
    "a case needs a Scene, not None": case("scene=None"),
    "stiffness is nan; give a finite number": case("body=TetrahedralBody(stiffness=float('nan'))"),
    "nodes is '100'; give a finite number": case("body=TetrahedralBody(nodes='100')"),
    "nodes = '100.5': Input should be a": case("body=TetrahedralBody(nodes=100.5)"),
    "body.weights[0] is the whole number 1; write 1.0": case("body=SurfaceBody(weights=(1, 0.5, 1.0, 1.0))"),
    "mine.py: scene 'tiny_squeeze': frames is None; give": case("scene=replace(SQUEEZE, frames=None)"),
    "case tiny_squeeze-tetrahedral-60-implicit_volume-dt0.5: damping": case("scene=replace(SQUEEZE, damping='none')"),
    "duration is inf s; give a finite number above 0": case("scene=replace(SQUEEZE, duration=float('inf'))"),
    "columns is 'volume_worst'; give a tuple": study("columns='volume_worst'"),
    "cases is one Case; give a tuple of them": study("cases=tiny_case()"),
    "cases holds 3, which is not a Case": study("cases=(3,)"),
    "the study 'tiny' has no cases; give at least one": study("cases=()"),
    "a study cannot be called 'cache'": study("name='cache'"),
    "name of a study is 7; give a text": study("name=7"),
    "question of a study is 5; give a text": study("question=5"),
    "a chart cannot be called": study("charts=(Chart('../../a.png', print),)"),
    "characters that cannot be printed": case(r"scene=replace(SQUEEZE, name='a\0b')"),
    "body.nodes is -5; give a": case("body=TetrahedralBody(nodes=-5)"),
    "body.graded is 'adaptiv'; give False, True or 'adaptive'": case("body=QuadraticBody(60, graded='adaptiv')"),
    "body.cut is 'virtual', and the scene has no cut": case("body=TetrahedralBody(nodes=60, cut='virtual')"),
    "scene.cuts is no tuple; write (Cut(...),)": case("scene=replace(SQUEEZE, cuts=[])"),
    "a cut has the name ''; give it one": f"{TOP}from studies.scene.library import BALL_INCISED\n"
    "unnamed = replace(BALL_INCISED.cut, name='')\n"
    "STUDY = tiny_study(cases=(tiny_case(scene=replace(BALL_INCISED, cuts=(unnamed,))),))\n",
    "'accuracy' is a study of the program; give yours": study("name='accuracy'"),
    "dt0.5 of scene 'tiny_squeeze' is there twice; leave one out": study("cases=2 * (tiny_case(),)"),
    "recorded is 'kinetic'; give": case("recorded='kinetic'"),
}


@pytest.fixture
def write(tmp_path):
    def written(*parts):
        path = tmp_path / "mine.py"
        path.write_text("".join(parts))
        return str(path)

    return written


@pytest.mark.parametrize("words", BROKEN)
def test_a_study_file_that_is_wrong(write, words):
    with pytest.raises(StudyError) as refusal:
        find_study(write(BROKEN[words]))
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    ("parts", "word", "name"),
    [
        ((SCENE,), "", "alone"),
        ((STUDY,), "", SQUEEZE.name),
        ((SEVERAL,), ":other", "other"),
        ((SEVERAL, SCENE), "", "alone"),
        ((SEVERAL, SCENE), f":{SQUEEZE.name}", SQUEEZE.name),
    ],
)
def test_a_scene_is_read_from_a_file(write, parts, word, name):
    assert find_scene(write(TOP, *parts) + word).name == name


@pytest.mark.parametrize(
    ("text", "word", "words"),
    [
        (SEVERAL, "", r"has 2 scenes: tiny_squeeze, other; name one of them, as .*mine.py:tiny_squeeze"),
        (SEVERAL, ":othr", r"unknown scene of .*mine.py 'othr'; did you mean 'other'"),
        ("SCENE = replace(SQUEEZE, frames=0)\n", "", "frames is 0; give a whole number from 1 on"),
    ],
)
def test_a_scene_that_cannot_be_told_or_cannot_start_is_refused(write, text, word, words):
    with pytest.raises(StudyError, match=words):
        find_scene(write(TOP, text) + word)


def test_a_scene_alone_is_a_study_of_four_bodies_with_charts(write):
    study = find_study(write(TOP, SCENE))
    assert study.name == "alone" and study.charts and [scene.name for scene in study.scenes] == ["alone"]
    assert [(case.body.kind, case.method.name, case.recorded) for case in study.cases] == [
        ("tetrahedral", "free", ("surface",)),
        ("tetrahedral", "implicit_volume", ("surface",)),
        ("quadratic", "implicit_volume", ("surface",)),
        ("quadratic", "implicit_volume", ("surface",)),
    ]
    assert len({case.body.nodes for case in study.cases[-2:]}) == 2  # whose difference says whether to trust them
    assert {"force_end", "mean_error", "shape_error", "shape_volume"} <= set(study.columns)
