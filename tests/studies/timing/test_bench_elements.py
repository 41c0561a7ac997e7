"""The bodies that `make bench` compares at updates of 1 ms run through the same scene, one step to an update."""

import numpy as np
import pytest

from massspring import ImplicitElements, ImplicitVolume, simulate
from studies.bench import elements
from studies.bench.elements import COARSE, QUADRATIC, UPDATE, UPDATES, element_lines, update_setup


def test_all_have_the_same_scene_and_an_update_is_a_step():
    springs = update_setup(QUADRATIC, ImplicitVolume())
    for body in COARSE.values():
        setup = update_setup(body, ImplicitElements())
        assert setup.clock == springs.clock and setup.clock.dt == UPDATE == setup.clock.frame
        assert [held.path for held in setup.attachments] == [held.path for held in springs.attachments]
    history = simulate(springs)
    assert history.outcome == "finished" and np.abs(history.held_force[-1, 1, 2]) > 0


def test_the_same_body_is_moved_alike():
    """The upper cap comes down: both follow it, but for what backward Euler takes of the first wave (12 %)."""
    ends = [simulate(update_setup(QUADRATIC, method)).final for method in (ImplicitVolume(), ImplicitElements())]
    rest = update_setup(QUADRATIC, ImplicitVolume()).body.rest
    moved = np.abs(ends[0] - rest).max()
    assert moved > 1e-4 and np.abs(ends[1] - ends[0]).max() < 0.2 * moved


def test_the_lines_are_ratios_with_their_target(monkeypatch):
    monkeypatch.setattr(elements, "ROUNDS", 2)
    monkeypatch.setattr(elements, "COARSE", {"linear, coarse": COARSE["linear, coarse"]})
    (line,) = element_lines()
    assert line.measured == pytest.approx(line.measured) and line.measured > 1.0 and line.verdict == ""
    assert UPDATES == 40 and "over the quadratic body" in line.what
