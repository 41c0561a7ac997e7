"""Every organ with a reference is fitted and judged on different scenes."""

import pytest

from studies.base.errors import StudyError
from studies.catalog.accuracy import judged_at_rest
from studies.scene.kind import has_wall
from studies.scene.library import BALL_CLAMPED, BALL_SQUEEZE, LIVER_PRESS, LIVER_PROBE, STOMACH_PRESS, STOMACH_PROBE
from studies.tools.calibrate.folds import folds_of

ORGANS = sorted({scene.organ.shape for scene in judged_at_rest()})


@pytest.mark.parametrize("organ", ORGANS)
def test_no_scene_judges_its_own_fit(organ):
    for fold in folds_of(organ):
        assert fold.fitted and fold.judged and len({scene.name for scene in fold.scenes}) == len(fold.scenes)
        assert all(scene.organ.shape == organ for scene in fold.fitted)
        assert len({has_wall(scene) for scene in fold.scenes}) == 1
        assert all(scene.reference is not None for scene in fold.scenes)


@pytest.mark.parametrize(
    ("organ", "pair"),
    [
        ("ball", (BALL_SQUEEZE, BALL_CLAMPED)),
        ("liver", (LIVER_PRESS, LIVER_PROBE)),
        ("stomach", (STOMACH_PRESS, STOMACH_PROBE)),
    ],
)
def test_two_scenes_are_crossed(organ, pair):
    folds = folds_of(organ)
    names = {scene.name for scene in pair}
    assert len(folds) == 2 and {fold.judged[0].name for fold in folds} == names
    assert all({scene.name for scene in fold.scenes} == names for fold in folds)


def test_one_scene_is_judged_by_other_organs():
    (kidney,), (bladder,) = folds_of("kidney"), folds_of("bladder")
    assert {scene.organ.shape for scene in kidney.judged} == {"ball", "liver", "spleen"}
    assert {scene.organ.shape for scene in bladder.judged} == {"stomach"}


def test_an_organ_without_a_scene_is_refused(monkeypatch):
    monkeypatch.setattr("studies.tools.calibrate.folds.judged_at_rest", lambda: (LIVER_PRESS, LIVER_PROBE))
    with pytest.raises(StudyError, match=r"organ 'kidney' has no scene with a reference to fit; choose one of liver"):
        folds_of("kidney")


def test_an_unknown_organ_is_answered_with_the_nearest():
    with pytest.raises(StudyError, match="unknown organ 'livr'; did you mean 'liver'"):
        folds_of("livr")
