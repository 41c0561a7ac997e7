"""A short timing is pinned, repeated, compiled before, and keeps to its seconds."""

import pytest

from studies.base.errors import StudyError
from studies.metrics.timing.cases import REPEATS
from studies.metrics.timing.protocol import FrameTiming
from studies.metrics.timing.short import ShortTiming, short_timing
from studies.scene.library import LIVER_PRESS
from studies.tools.advise import answer as answers
from studies.tools.advise.answer import advise
from tests.studies.plots.made_up import frame_ns
from tests.studies.tiny import FRAMES, tiny_case
from tests.studies.tools.advise.made_up_campaign import GRADED, publish, rows_of


def test_frames_are_timed_as_often_as_the_protocol_says(mesh_cache):
    short = short_timing(tiny_case())
    assert short.timing.frame_ns.shape == (REPEATS, FRAMES) and (short.timing.frame_ns > 0).all()
    assert short.covered == pytest.approx(tiny_case().scene.duration)


def test_a_dear_case_is_timed_over_its_first_frames(mesh_cache):
    short = short_timing(tiny_case(frames=50), seconds=1e-9)
    assert short.frames == 1 and short.covered == pytest.approx(tiny_case().scene.duration / 50)


def test_a_case_that_breaks_off_is_one_sentence(mesh_cache):
    with pytest.raises(StudyError, match="cannot be timed here: the run broke off"):
        short_timing(tiny_case(dt_fraction=3.0, beyond_limit=True, frames=100))


def made_up(case):
    """Half as fast as real time."""
    return ShortTiming(FrameTiming(frame_ns(200.0), 0), 0.1 * 1.02, 40, 3e-3)


def test_advice_times_what_was_timed_elsewhere(tmp_path, monkeypatch):
    monkeypatch.setattr(answers, "short_timing", made_up)
    results = publish(tmp_path, rows_of(LIVER_PRESS), machine="0badcafe")
    advice = advise(LIVER_PRESS, results=results)
    assert advice.chosen.case.body == GRADED and advice.meets and advice.chosen.timed_here
    assert advice.real_time == pytest.approx(0.5) and advice.chosen.dt == 3e-3
    assert advice.chosen.cost.uncertainty == pytest.approx(0.5 * 0.04 * 2.0 / 1.02)
    assert not advise(LIVER_PRESS, budget=1.0, results=results).meets
    assert advise(LIVER_PRESS, budget=1.0, results=results, timing=False).meets
