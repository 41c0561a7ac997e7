"""References of scenes beside the second judge: what is compared, what is allowed, and what would be seen."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from reference_fem import crosscheck
from reference_fem.crosscheck.meridian import MeridianMesh
from studies.scenes import BALL_CLAMPED, BALL_SQUEEZE
from studies.verify import second_judge
from studies.verify.second_judge import Judge, ball_of, centred, halves, moving, second_judges, verdict
from tests.studies.octant import SCENE


def test_without_the_other_code_there_is_no_judge(monkeypatch, tmp_path):
    monkeypatch.setattr(crosscheck, "available", lambda: False)
    assert second_judges(tmp_path) == ()


def test_the_judge_has_the_load_of_the_scene():
    """Checkpoints at rest add no step; each step is taken in two; the ball is the scene's."""
    times = moving(BALL_SQUEEZE, BALL_SQUEEZE.obstacles[0].path)
    assert times[-1] == BALL_SQUEEZE.checkpoints[-1]
    assert len(set(np.linalg.norm([BALL_SQUEEZE.obstacles[0].path(t) for t in times], axis=1))) == len(times)
    assert halves([1.0, 3.0]) == [0.5, 1.0, 2.0, 3.0]
    ball = ball_of(BALL_CLAMPED)
    assert ball.radius == 0.05
    assert ball.material.kappa / ball.material.mu == pytest.approx(BALL_CLAMPED.tissue.bulk_over_shear)


def test_the_judge_looks_from_the_middle_between_the_caps():
    """The lower cap stays in the scene and comes up half the push in the judge's frame."""
    end = BALL_CLAMPED.checkpoints[-1]
    push = BALL_CLAMPED.held[1].path(end)
    np.testing.assert_allclose(centred(BALL_CLAMPED, np.stack([np.zeros(3), push])), [-push / 2, push / 2])


def solution(force) -> Any:
    return SimpleNamespace(force=np.array([force]), mesh=SimpleNamespace(ne=7))


@pytest.mark.parametrize(("share", "met"), [(0.0, True), (1.2, True), (1.6, False)])
def test_a_reference_beyond_its_bar_and_the_judges_change_is_off(found, share, met):
    """The judge is moved away by so many bars; it changes by half a bar from its coarse mesh to its fine one."""
    bar = found.total_uncertainty["force_end"]
    theirs = found.force[-1] / (1 + share * bar)
    coarse, fine = MeridianMesh(0.2, 0), MeridianMesh(0.1, 0)
    answers = {coarse: solution(theirs * (1 + bar / 2)), fine: solution(theirs)}
    (check,) = verdict(Judge(SCENE, lambda mesh: answers[mesh], coarse, fine), found).checks
    assert bool(check.met) is met
    assert check.tolerance == pytest.approx(1.5 * bar, rel=1e-9)


def test_the_judged_scenes_are_named(monkeypatch, tmp_path):
    monkeypatch.setattr(crosscheck, "available", lambda: True)
    monkeypatch.setattr(second_judge, "version", lambda name: "6.2")
    assert [oracle.name for oracle in second_judges(tmp_path)] == ["judge_ball_squeeze", "judge_ball_clamped"]
    assert not any(oracle.fast for oracle in second_judges(tmp_path))
