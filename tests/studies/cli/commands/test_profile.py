"""The cost table adds up, names what was left out, and what was left out changes no answer."""

import json
import re

import numpy as np
import pandas as pd
import pytest

from massspring import Free, ImplicitVolume
from studies.cli.commands import profile
from studies.cli.commands.profile import COST, SHARE, SPREAD, WHOLE
from studies.metrics.timing.skips import SKIPS
from studies.metrics.timing.stage_cost import ENERGIES, FRAME, ROWS, SKIPPED, STAGE, cost_table, run_frames
from studies.runs.prepare import prepare
from studies.runs.recipes import SurfaceBody, TetrahedralBody
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.library.stomach_slide import STOMACH_SLIDE
from tests.studies.tiny import tiny_case

HELD = TetrahedralBody(nodes=100)
"""Fewer do not keep the area where the ball is held."""
NO_CONTACT = "contact of nodes: no plane, sphere or capsule"


@pytest.fixture(scope="module")
def squeezed(mesh_cache):
    return cost_table(tiny_case(), repeats=2)


def test_a_turn_begins_only_when_there_is_time_for_it(squeezed):
    assert squeezed.attrs["turns"] == 2
    assert cost_table(tiny_case(), repeats=5, budget=0.0).attrs["turns"] == 1


def cost_of(table, what) -> float:
    return float(table.set_index("what")["µs per step"][what])


def test_stages_and_rest_are_the_whole_step(squeezed):
    parts = squeezed[(squeezed["kind"] == STAGE) & (squeezed["what"] != "whole step")]
    whole = cost_of(squeezed, "whole step")
    assert parts["µs per step"].sum() == pytest.approx(whole, rel=1e-12)
    assert parts["share of the step"].sum() == pytest.approx(1.0, rel=1e-12)
    assert set(parts["what"]) <= {*ROWS, "rest, not attributed"}
    assert cost_of(squeezed, "springs and prediction") > 0 and cost_of(squeezed, "contact search") > 0


def test_what_is_left_out_is_named(squeezed):
    left_out = squeezed[squeezed["kind"] == SKIPPED]["what"].tolist()
    missing = ["thin probe: none", "gravity: none in this scene"]
    one = "linear solve: one volume is a division"
    assert left_out == [*missing, "friction: no obstacle has any", one, ENERGIES]
    bare = cost_table(tiny_case(scene=BALL_CLAMPED, body=HELD, method=Free()), repeats=1)
    assert bare[bare["kind"] == SKIPPED]["what"].tolist() == [NO_CONTACT, *missing, ENERGIES]
    assert "contact search" not in set(bare["what"])
    assert len(squeezed[squeezed["kind"] == FRAME]) == 2


LEFT_OUT = [
    pytest.param(
        skip,
        method,
        id=f"{method.name}-{skip.name.split(':')[0]}",
        marks=pytest.mark.campaign if skip.name.startswith("pairs") else (),  # the mesh of a stomach
    )
    for skip in SKIPS
    for method in (Free(), ImplicitVolume())
    if method.capabilities.keeps != "none" or not skip.name.startswith("linear solve")
]


@pytest.mark.parametrize(("skip", "method"), LEFT_OUT)
def test_leaving_a_stage_out_changes_no_answer(skip, method):
    """Bit for bit; the small solve in place of the division adds in another order, and differs by round-off."""
    case = tiny_case(method=method)
    if skip.name.startswith("contact"):
        case = case.replaced(scene=BALL_CLAMPED, body=HELD)
    if skip.name.startswith("pairs"):
        case = case.replaced(scene=STOMACH_SLIDE, body=SurfaceBody(300))
    setup = prepare(case).setup
    assert skip.left_out(setup)
    without = run_frames(setup, setup.start())[2]
    with_stage = run_frames(*skip.included(setup, setup.start()))[2]
    if skip.name.startswith("linear solve"):
        assert np.abs(without.x - with_stage.x).max() < 1e-6 * setup.body.size
    else:
        assert np.array_equal(without.x, with_stage.x) and np.array_equal(without.v, with_stage.v)


@pytest.mark.campaign
def test_the_table_counts_the_pairs_that_sleep(mesh_cache):
    """Of the thin probe on the stomach nearly all pairs sleep, and the line says what was still compared."""
    table = cost_table(tiny_case(scene=STOMACH_SLIDE, body=SurfaceBody(300)), repeats=1)
    assert "thin probe: none" not in set(table["what"])
    (line,) = (text for text in table["how much"] if text)
    pairs, boxes = re.search(r"of ([0-9,]+) pairs a step ([0-9.e+]+) boxes compared", line).groups()
    assert 0 < float(boxes) < 0.5 * int(pairs.replace(",", ""))
    assert line.endswith("left behind 0")


def test_the_command_prints_a_table_or_json(organbench, tmp_path, monkeypatch):
    monkeypatch.setattr(profile.console, "_width", 120)  # long numbers would wrap the names of what is skipped
    words = ("profile", "ball_clamped", "--nodes", HELD.nodes, "--method", "free")
    code, out, _ = organbench(*words, "--csv", tmp_path / "cost.csv")
    assert code == 0 and "springs and prediction" in out and NO_CONTACT in out
    assert (tmp_path / "cost.csv").read_text(encoding="utf-8").startswith("kind,what,")
    code, out, _ = organbench(*words, "--json")
    rows = json.loads(out)
    assert {row["kind"] for row in rows} == {STAGE, SKIPPED, FRAME} and all(row[SPREAD] >= 0.0 for row in rows)


def test_costs_have_the_spread_of_the_measurements(organbench, monkeypatch):
    def made(friction):
        rows = [
            (STAGE, WHOLE, 20.0, ""),
            (SKIPPED, "gravity", 2.0 + 0.1 * friction, ""),
            (SKIPPED, "friction", friction, ""),
        ]
        table = pd.DataFrame(rows, columns=["kind", "what", COST, "how much"])
        return table.assign(**{SHARE: table[COST] / 20.0})

    tables = map(made, (-0.7, 0.1, -0.3))
    monkeypatch.setattr(profile, "cost_table", lambda case, budget: next(tables))
    out = organbench("profile", "ball_clamped", "--nodes", HELD.nodes)[1]
    assert re.search(r"gravity +1\.97 ± 0\.04 +9\.8 %", out)
    assert re.search(r"friction +−0\.3 ± 0\.4 +below resolution", out)


def test_a_stage_that_one_measurement_missed_counts_as_zero_there(monkeypatch):
    """Two measurements miss one stage each, so that no table has them all."""

    def made(stage, cost):
        rows = [(STAGE, "springs", 3.0, ""), (STAGE, stage, cost, ""), (STAGE, WHOLE, 6.0, ""), (FRAME, "paths", 1, "")]
        return pd.DataFrame(rows, columns=["kind", "what", COST, "how much"]).assign(**{SHARE: 0.0})

    tables = iter([made("contact", 3.0), made("gravity", 1.5), made("contact", 3.0)])
    monkeypatch.setattr(profile, "cost_table", lambda case, budget: next(tables))
    costs = profile.measured(tiny_case())
    assert costs["kind"].tolist() == [STAGE] * 4 + [FRAME]
    assert dict(zip(costs["what"], costs[COST], strict=True)) == {
        "springs": 3.0, "contact": 2.0, WHOLE: 6.0, "gravity": 0.5, "paths": 1.0,
    }  # fmt: skip
    assert costs.set_index("what")[SPREAD]["gravity"] == 0.75 and costs.set_index("what")[SHARE]["contact"] == 1 / 3


def test_bad_words_are_refused(refused):
    assert "did you mean 'ball_squeeze'" in refused("profile", "bal_squeeze")
    assert "unknown body 'solid'" in refused("profile", "ball_squeeze", "--body", "solid")
