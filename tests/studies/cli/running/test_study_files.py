"""Study files of a user that are wrong: one sentence with the line that is at fault."""

import pytest

BROKEN = {
    "no STUDY": ("CASES = 3\n", "defines neither STUDY nor SCENE"),
    "another type": ("STUDY = 'volume_loss'\n", "is str; give a Study, as `from studies import Study`"),
    "syntax": ("import os\nSTUDY = (\n", "SyntaxError in line 2: '(' was never closed"),
    "import": ("\nimport massspringg\n", "ModuleNotFoundError in line 2: No module named 'massspringg'"),
    "name": ("def f():\n    return nothing\nf()\n", "NameError in line 2: name 'nothing' is not defined"),
    "misspelt setting": (
        "from studies import SCENES\nfrom studies.runs.case import Case\nSTUDY = Case(SCENES[0], dtt=1)\n",
        "TypeError in line 3",
    ),
    "dt zero": (
        "from tests.studies.tiny import *\nSTUDY = tiny_study(cases=(tiny_case(dt=0.0),))\n",
        "dt is 0.0 s; it must be",
    ),
    "dt negative": (
        "from tests.studies.tiny import *\nSTUDY = tiny_study(cases=(tiny_case(dt=-1),))\n",
        "dt is -1 s; it must be",
    ),
    "obstacle": (
        "from massspring import Plane\nPlane((0, 0, 0), (0, 0, 0))\n",
        "in line 2: the plane normal is (0, 0, 0); it needs a direction",
    ),
    "metric": (
        "from tests.studies.tiny import *\nSTUDY = tiny_study(columns=('volume_wort',))\n",
        "unknown metric 'volume_wort'; did you mean 'volume_worst'",
    ),
    "study name": (
        "from tests.studies.tiny import *\nSTUDY = tiny_study(name='../elsewhere')\n",
        "'../elsewhere' cannot name a study",
    ),
    "own method": (
        "from dataclasses import dataclass\nfrom massspring import Free\nfrom tests.studies.tiny import *\n\n"
        "@dataclass(frozen=True)\nclass Mine(Free):\n    pass\n\n"
        "STUDY = tiny_study(cases=(tiny_case(method=Mine()),))\n",
        "method 'free' is one of the project's own; give yours another name",
    ),
}


OWN = (
    "from studies import Chart, QuadraticBody, SurfaceBody\nfrom massspring import Free\n"
    "from tests.studies.tiny import *\n"
)
CUTTING = OWN + "from studies.scene.library import BALL_INCISED\nunnamed = replace(BALL_INCISED.cut, name='')\n"


BROKEN |= {
    "sys.exit": ("import sys\nsys.exit(3)\n", "cannot be loaded: SystemExit in line 2: 3"),
    "BaseException": ("raise BaseException\n", "cannot be loaded: BaseException in line 1; correct it and run again"),
    "method class": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(method=Free),))\n",
        "in line 4: the method is Free",
    ),
    "no body": (
        OWN + "STUDY = tiny_study(cases=(Case(SQUEEZE, None),))\n",
        "in line 4: a case needs a BodyRecipe, not None",
    ),
    "no scene": (OWN + "STUDY = tiny_study(cases=(tiny_case(scene=None),))\n", "a case needs a Scene, not None"),
    "nan": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(body=TetrahedralBody(stiffness=float('nan'))),))\n",
        "body.stiffness is nan; give a finite number",
    ),
    "text for a number": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(body=TetrahedralBody(nodes='100')),))\n",
        "body.nodes = '100' cannot be stored and read back",
    ),
    "half a node": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(body=TetrahedralBody(nodes=100.5)),))\n",
        "'tiny_squeeze', case tiny_squeeze-tetrahedral-100.5-implicit_volume-dt0.5: nodes = '100.5': Input should be a",
    ),
    "whole weight": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(body=SurfaceBody(weights=(1, 0.5, 1.0, 1.0))),))\n",
        "mine.py: scene 'tiny_squeeze', case tiny_squeeze-surface-550-implicit_volume-dt0.5-w1_0.5_1_1: "
        "body.weights[0] is the whole number 1; write 1.0",
    ),
    "frames of a scene": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(scene=replace(SQUEEZE, frames=None)),))\n",
        "mine.py: scene 'tiny_squeeze': frames is None; give a whole number from 1 on",
    ),
    "damping in words": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(scene=replace(SQUEEZE, damping='none')),))\n",
        "mine.py: scene 'tiny_squeeze', case tiny_squeeze-tetrahedral-60-implicit_volume-dt0.5: damping = 'none'",
    ),
    "endless": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(scene=replace(SQUEEZE, duration=float('inf'))),))\n",
        "mine.py: scene 'tiny_squeeze': the duration is inf s; give a finite number above 0",
    ),
    "columns": (OWN + "STUDY = tiny_study(columns='volume_worst')\n", "columns is 'volume_worst'; give a tuple"),
    "one case": (OWN + "STUDY = tiny_study(cases=tiny_case())\n", "cases is one Case; give a tuple of them"),
    "no case": (OWN + "STUDY = tiny_study(cases=(3,))\n", "cases holds 3, which is not a Case"),
    "reserved": (OWN + "STUDY = tiny_study(name='cache')\n", "a study cannot be called 'cache'"),
    "chart elsewhere": (
        OWN + "STUDY = tiny_study(charts=(Chart('../../a.png', print),))\n",
        "a chart cannot be called",
    ),
    "zero byte": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(scene=replace(SQUEEZE, name='a\\0b')),))\n",
        "has a name with characters that cannot be printed",
    ),
    "no nodes": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(body=TetrahedralBody(nodes=-5)),))\n",
        "body.nodes is -5; give a",
    ),
    "graded how": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(body=QuadraticBody(60, graded='adaptiv')),))\n",
        "body.graded is 'adaptiv'; give False, True or 'adaptive'",
    ),
    "virtual nodes and no cut": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(body=TetrahedralBody(nodes=60, cut='virtual')),))\n",
        "body.cut is 'virtual', and the scene has no cut; leave it out",
    ),
    "a list of cuts": (
        OWN + "STUDY = tiny_study(cases=(tiny_case(scene=replace(SQUEEZE, cuts=[])),))\n",
        "scene.cuts is no tuple; write (Cut(...),)",
    ),
    "a cut without a name": (
        CUTTING + "STUDY = tiny_study(cases=(tiny_case(scene=replace(BALL_INCISED, cuts=(unnamed,))),))\n",
        "a cut has the name ''; give it one",
    ),
    "no cases": (OWN + "STUDY = tiny_study(cases=())\n", "mine.py: the study 'tiny' has no cases; give at least one"),
    "recorded": (OWN + "STUDY = tiny_study(cases=(tiny_case(recorded='kinetic'),))\n", "recorded is 'kinetic'; give"),
}


CHARTS = {
    "lambda r, p: 1/0": "chart a.png is not drawn, mine.py fails: ZeroDivisionError in line 4: division by zero",
    "lambda r: 1": "chart a.png is not drawn, its function fails: TypeError",
}


@pytest.mark.parametrize("fault", BROKEN)
def test_a_study_file_that_is_wrong(refused, tmp_path, fault):
    text, message = BROKEN[fault]
    path = tmp_path / "mine.py"
    path.write_text(text)
    for command in ("run", "table", "show"):
        assert message in refused(command, path, "--results", tmp_path / "results")
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize("draw", CHARTS)
def test_a_chart_that_fails_is_a_sentence_after_all_else_is_done(refused, results, tmp_path, draw):
    path = tmp_path / "mine.py"
    other = "Chart('b.txt', lambda r, p: p.write_text('drawn'))"
    path.write_text(OWN + f"STUDY = tiny_study(charts=(Chart('a.png', {draw}), {other}))\n")
    assert CHARTS[draw] in refused("report", path, "--results", results)
    assert (results / "tiny" / "b.txt").read_text() == "drawn"
    assert (results / "tiny" / "tiny.csv").exists()


def test_a_dry_run_with_a_missing_mesh_file_is_refused(refused, tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(
        "from studies import SurfaceBody\nfrom tests.studies.tiny import *\n"
        "STUDY = tiny_study(cases=(tiny_case(scene=file_scene('none.stl'), body=SurfaceBody()),))\n"
    )
    assert "there is no mesh file none.stl" in refused("run", file, "--dry-run", "--results", tmp_path / "results")
