"""A cut in a scene, and that scenes without one are stored as before."""

import json
from dataclasses import replace

import pytest

from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.geometry import BallRegion, HalfSpace
from studies.meshing.scene_mesh import mesh_for
from studies.reference.published import published
from studies.runs.case import Case, case_from_json
from studies.scene.as_json import scene_from_dict, scene_to_dict, scene_to_json
from studies.scene.checks import check_scene
from studies.scene.cut import Cut
from studies.scene.library import (
    BALL_BISECTED,
    BALL_CLAMPED,
    BALL_CUT_PRESSED,
    BALL_CUT_TWICE,
    BALL_INCISED,
    JUDGED,
    LIVER_CUT_LIVE,
    LIVER_INCISED,
    SHELL_OPENED,
)
from studies.scene.library.ball_cuts import CUT_AT, HALF
from studies.scene.scene import Organ

MIDDLE = HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
CUT = Cut("slit", MIDDLE, BallRegion((0.0, 0.0, 0.0), 0.01), at=1.0)


def test_scenes_without_a_cut_keep_their_keys():
    """Keys of stored runs and of published references: no word of cuts is in them, and every reference is there."""
    assert all('"cuts"' not in case.key for study in STUDIES for case in study.cases if not case.scene.cuts)
    assert all(published(scene) is not None for scene in JUDGED if not scene.cuts)


def test_a_scene_with_a_cut_is_read_back_as_it_was():
    scene = replace(BALL_CLAMPED, cuts=(CUT,))
    assert scene_from_dict(json.loads(scene_to_json(scene))) == scene
    case = Case(scene)
    assert case_from_json(case.key).scene.cut == CUT and case.key != Case(BALL_CLAMPED).key
    assert published(scene) is None


@pytest.mark.parametrize("scene", [BALL_INCISED, BALL_CUT_PRESSED, LIVER_CUT_LIVE, LIVER_INCISED], ids=lambda s: s.name)
def test_what_a_cut_does_not_have_is_not_stored(scene):
    """As records of before have it."""
    stored = scene_to_dict(scene)
    assert scene_from_dict(stored) == scene
    optional = {"contact": scene.cuts[0].contact, "until": scene.cuts[0].until is not None}
    assert all((name in stored["cuts"][0]) == given for name, given in optional.items())


def test_cuts_that_no_scene_can_have_are_refused(tmp_path):
    with pytest.raises(StudyError, match=r"is made at 0.0 s; give a time after the start"):
        Cut("early", MIDDLE)
    with pytest.raises(StudyError, match="has two cuts called"):
        replace(BALL_CLAMPED, cuts=(CUT, CUT))
    file = replace(BALL_CLAMPED, cuts=(CUT,), organ=Organ("file", {"path": str(tmp_path / "no.stl")}))
    with pytest.raises(StudyError, match="only organs of the catalogue are cut so far"):
        mesh_for(file, 200)


ALONG = (1.0, 0.0, 0.0)
FRONTS = {
    "has until and no along": {"until": 2.0},
    "has along and no until": {"along": ALONG},
    "advances from 1 s until 0.5 s; give a later end": {"until": 0.5, "along": ALONG},
    "advances from 1 s until 1 s; give a later end": {"until": 1.0, "along": ALONG},
    "advances from 1 s until nan s; give a later end": {"until": float("nan"), "along": ALONG},
    "give a direction of finite numbers, not all 0": {"until": 2.0, "along": (0.0, float("inf"), 0.0)},
    "advances along the normal of its plane": {"until": 2.0, "along": (0.0, 0.0, -3.0)},
}


@pytest.mark.parametrize("words", FRONTS)
def test_fronts_that_cannot_be_are_refused(words):
    with pytest.raises(StudyError) as problem:
        Cut("knife", BALL_INCISED.cut.plane, at=1.0, **FRONTS[words])
    assert words in str(problem.value)


def with_cut(scene, **changes):
    return replace(scene, cuts=(replace(scene.cuts[0], **changes), *scene.cuts[1:]))


LIVE = with_cut(BALL_INCISED, until=2.0, along=ALONG)
BELOW, ABOVE = BALL_CUT_TWICE.cuts
TWICE = replace(BALL_CUT_TWICE, cuts=(BELOW, replace(ABOVE, at=CUT_AT)), reference=None)
ACROSS = Cut("across", HalfSpace((0.0, 0.0, 0.0), (0.5, 0.0, 1.0)), HALF, at=1.0)
SCENES = {
    "the planes of cuts 'below' and 'across' meet inside the body": lambda: replace(TWICE, cuts=(BELOW, ACROSS)),
    "faces of one cut touch and those of another do not": lambda: replace(
        TWICE, cuts=(BELOW, replace(ABOVE, contact=True))
    ),
    "has its last checkpoint at 4 s and its cut at 4 s": lambda: replace(
        BALL_CUT_TWICE, duration=5.0, cuts=(BELOW, replace(ABOVE, at=4.0))
    ),
    "a checkpoint at 1.5 s, and cut 'incision' advances from 1 to 2 s": lambda: replace(
        LIVE, checkpoints=(1.0, 1.5, 4.0)
    ),
    "within one of 200 frames; ask for more frames": lambda: with_cut(BALL_INCISED, until=1.001, along=ALONG),
    "at 5 s is not between two of the 200 frames": lambda: with_cut(BALL_BISECTED, until=5.0, along=ALONG),
    "the checkpoint at 2.005 s and cut 'incision' before it at 2 s are in one": lambda: replace(
        LIVE, checkpoints=(1.0, 2.005, 4.0)
    ),
    "let what fills it go: opens_lumen=True": lambda: with_cut(SHELL_OPENED, opens_lumen=False),
    "is a disc inside the body, and the organ is hollow": lambda: with_cut(
        SHELL_OPENED, within=BallRegion((0.0, 0.0, 0.0), 0.01)
    ),
    "no cut through a wall has yet; leave out contact": lambda: with_cut(SHELL_OPENED, contact=True),
    "opens a lumen, and its organ is solid; leave it out": lambda: replace(
        BALL_CLAMPED, cuts=(replace(SHELL_OPENED.cuts[0], at=0.5),)
    ),
}


@pytest.mark.parametrize("words", SCENES)
def test_scenes_whose_cuts_cannot_be_are_refused(words):
    with pytest.raises(StudyError) as problem:
        check_scene(SCENES[words]())
    assert words in str(problem.value)
