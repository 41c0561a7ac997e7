"""Cuts that a scene, a body or a method cannot have: one sentence each, at the first place that can say it."""

from dataclasses import replace

import pytest

from massspring import Free, ImplicitVolume, LinearModes, MassSpringError, Penalty, Shake
from studies.base.errors import DoesNotApply, StudyError
from studies.exchange.meshes import given_scene
from studies.geometry import BallRegion, HalfSpace, organ
from studies.runs.case import Case
from studies.runs.prepare import prepare
from studies.runs.recipes import MembraneBody, SurfaceBody, TetrahedralBody
from studies.scene.as_json import scene_from_dict, scene_to_dict
from studies.scene.checks import check_scene
from studies.scene.cut import Cut
from studies.scene.library import BALL_CLAMPED, LIVER_CUT_LIVE, LIVER_INCISED
from studies.scene.library.ball_cuts import (
    AWAY,
    BALL_BISECTED,
    BALL_CUT_PRESSED,
    BALL_CUT_TWICE,
    BALL_INCISED,
    CUT_AT,
    HALF,
    RADIUS,
    SHELL_OPENED,
)

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
TOUCHING = replace(ABOVE, contact=True)
ACROSS = Cut("across", HalfSpace((0.0, 0.0, 0.0), (0.5, 0.0, 1.0)), HALF, at=1.0)
SCENES = {
    "the planes of cuts 'below' and 'across' meet inside the body": lambda: replace(TWICE, cuts=(BELOW, ACROSS)),
    "two cuts called 'below'": lambda: replace(TWICE, cuts=(BELOW, replace(ABOVE, name="below"))),
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


ONE, SURFACE, VIRTUAL = TetrahedralBody(nodes=120), SurfaceBody(nodes=120), TetrahedralBody(nodes=120, cut="virtual")
NODAL = TetrahedralBody(nodes=120, law="cotangent", volumes="nodal")
LOOSE = replace(BALL_BISECTED, held=BALL_BISECTED.held[:1])
SECTIONS = replace(TWICE, cuts=tuple(replace(cut, within=None, free=True) for cut in TWICE.cuts))
CASES = {
    "it keeps one volume, the body keeps 2": lambda: Case(BALL_BISECTED, ONE, Shake()),
    "leaves a piece that nothing holds": lambda: Case(LOOSE, ONE),
    "' leaves a piece that nothing holds": lambda: Case(LOOSE, SURFACE),
    "a piece that nothing holds": lambda: Case(LOOSE, VIRTUAL),
    "is not between two of the 200 frames": lambda: Case(with_cut(BALL_INCISED, at=4.0), ONE),
    "at 1.001 s and cut 'incision' before it at 1 s are in one of 200 frames": lambda: Case(
        replace(BALL_INCISED, checkpoints=(1.001, 4.0)), ONE
    ),
    "cut 'incision' ends inside the organ, where this body has no tissue": lambda: Case(BALL_INCISED, SURFACE),
    "it has 2 cuts, and this body is cut once": lambda: Case(SECTIONS, SURFACE),
    "which has 2 cuts; take cut 'conforming'": lambda: Case(TWICE, VIRTUAL),
    "no body that changes in a run: its modes are those of one body": lambda: Case(LIVE, NODAL, LinearModes()),
    "its steps do not keep the faces of a cut": lambda: Case(BALL_CUT_PRESSED, ONE, Free()),
    "whose faces of the cut touch: no node lies on them": lambda: Case(BALL_CUT_PRESSED, VIRTUAL),
    "'ball_incised': it has no cut; leave cut out": lambda: Case(replace(BALL_INCISED, cuts=()), VIRTUAL),
    "knows no cells of which a part alone is tissue": lambda: Case(BALL_INCISED, VIRTUAL, Penalty()),
    "keeps one volume, or one per node": lambda: Case(BALL_INCISED, replace(VIRTUAL, volumes="patches")),
    "which a membrane body cannot do yet": lambda: Case(SHELL_OPENED, MembraneBody(nodes=250)),
    "which a surface body cannot do yet": lambda: Case(SHELL_OPENED, SurfaceBody(nodes=250)),
    "whose cut opens a lumen": lambda: Case(SHELL_OPENED, replace(VIRTUAL, nodes=250)),
    "keeps wall and content as one volume; keep them apart": lambda: Case(
        SHELL_OPENED, TetrahedralBody(nodes=250, volumes="whole")
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("words", CASES)
def test_bodies_and_methods_that_cannot_be_cut_are_refused(words):
    with pytest.raises((StudyError, DoesNotApply, MassSpringError)) as problem:
        prepare(CASES[words]())
    assert words in str(problem.value)


def test_what_is_made_for_one_cut_refuses_two():
    with pytest.raises(StudyError, match="it has 2 cuts, and files and words of an export are of one"):
        given_scene(BALL_CUT_TWICE)
    with pytest.raises(StudyError, match=r"come within 2\.[56] mm of each other, and the edges"):
        near = HalfSpace((0.0, 0.0, -AWAY * RADIUS + 2.5e-3), (0.0, 0.0, 1.0))
        organ("ball", 200, {}, cuts=(BELOW, replace(ABOVE, plane=near)))


@pytest.mark.slow
def test_two_sections_leave_three_pieces_and_the_free_one_is_allowed():
    cuts = tuple(
        Cut(name, HalfSpace((0.0, 0.0, z), (0.0, 0.0, 1.0)), at=1.0) for name, z in (("a", -0.015), ("b", 0.015))
    )
    with pytest.raises(StudyError, match="cut 'a' or 'b' leaves a piece that nothing holds"):
        prepare(Case(replace(BALL_BISECTED, cuts=cuts), ONE, ImplicitVolume()))
    freed = replace(BALL_BISECTED, cuts=(cuts[0], replace(cuts[1], free=True)))
    assert set(prepare(Case(freed, ONE, ImplicitVolume())).opening.parts) == {0, 1, 2}


@pytest.mark.parametrize("scene", [BALL_INCISED, BALL_CUT_PRESSED, LIVER_CUT_LIVE, LIVER_INCISED], ids=lambda s: s.name)
def test_a_scene_with_a_cut_is_read_back_as_it_was(scene):
    stored = scene_to_dict(scene)
    assert scene_from_dict(stored) == scene
    optional = {"contact": scene.cuts[0].contact, "until": scene.cuts[0].until is not None}
    assert all((name in stored["cuts"][0]) == given for name, given in optional.items()), "as records of before have it"
