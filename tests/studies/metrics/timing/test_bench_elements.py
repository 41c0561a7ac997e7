"""The bodies that `make bench` compares at updates of 1 ms run through the same scene, one step to an update."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from massspring import ImplicitElements, ImplicitVolume, simulate
from studies.bench import elements
from studies.bench.elements import PAIRS, QUADRATIC, UPDATE, UPDATES, element_lines, update_setup
from studies.runs.recipe_text import case_of_recipe
from studies.scene.library.ball_clamped import BALL_CLAMPED

PUBLISHED = Path(__file__).parents[4] / "results" / "published" / "accuracy" / "accuracy.csv"


def test_all_have_the_same_scene_and_an_update_is_a_step():
    springs = update_setup(QUADRATIC, ImplicitVolume())
    for body, ours in PAIRS.values():
        setup = update_setup(body, ImplicitElements())
        assert update_setup(ours, ImplicitVolume()).clock == springs.clock
        assert setup.clock == springs.clock and setup.clock.dt == UPDATE == setup.clock.frame
        assert [held.path for held in setup.attachments] == [held.path for held in springs.attachments]
    history = simulate(springs)
    assert history.outcome == "finished" and np.abs(history.held_force[-1, 1, 2]) > 0


@pytest.mark.campaign
def test_the_same_body_is_moved_alike():
    """The upper cap comes down: both follow it, but for what backward Euler takes of the first wave (12 %)."""
    ends = [simulate(update_setup(QUADRATIC, method)).final for method in (ImplicitVolume(), ImplicitElements())]
    rest = update_setup(QUADRATIC, ImplicitVolume()).body.rest
    moved = np.abs(ends[0] - rest).max()
    assert moved > 1e-4 and np.abs(ends[1] - ends[0]).max() < 0.2 * moved


def test_the_lines_are_ratios_with_their_target(monkeypatch):
    monkeypatch.setattr(elements, "ROUNDS", 2)
    monkeypatch.setattr(elements, "PAIRS", {"linear, coarse": PAIRS["linear, coarse"]})
    (line,) = element_lines()
    assert line.measured == pytest.approx(line.measured) and line.measured > 1.0
    assert UPDATES == 40 and "that is as accurate" in line.what


def test_the_body_beside_elements_is_the_more_accurate_one():
    """By the published table; the same body differs in what keeps its volumes alone."""
    rows = pd.read_csv(PUBLISHED).query("scene == 'ball_clamped'")

    def error(body, method) -> float:
        errors = [
            row["mean_error [%]"]
            for row in rows.to_dict("records")
            if case_of_recipe(BALL_CLAMPED, row["recipe"]).body == body and row["method"].startswith(method)
        ]
        return max(errors)

    for theirs, ours in list(PAIRS.values())[:2]:
        ours = replace(ours, contact="facets", mass="stiffness" if ours.kind == "quadratic" else "lumped")
        assert error(ours, "implicit_volume") < error(theirs, "implicit_elements")
