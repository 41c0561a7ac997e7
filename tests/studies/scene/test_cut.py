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
from studies.scene.as_json import scene_from_dict, scene_to_json
from studies.scene.cut import Cut
from studies.scene.library import BALL_CLAMPED, JUDGED
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


def test_cuts_that_no_scene_can_have_are_refused(tmp_path):
    with pytest.raises(StudyError, match=r"is made at 0.0 s; give a time after the start"):
        Cut("early", MIDDLE)
    with pytest.raises(StudyError, match="has two cuts called"):
        replace(BALL_CLAMPED, cuts=(CUT, CUT))
    file = replace(BALL_CLAMPED, cuts=(CUT,), organ=Organ("file", {"path": str(tmp_path / "no.stl")}))
    with pytest.raises(StudyError, match="only organs of the catalogue are cut so far"):
        mesh_for(file, 200)
