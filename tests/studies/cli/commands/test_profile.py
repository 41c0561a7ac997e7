"""`organbench profile`: the table of costs, with the spread of the measurements."""

import json
import re

import pandas as pd

from studies.cli.commands import profile
from studies.cli.commands.profile import COST, SHARE, SPREAD, WHOLE
from studies.metrics.timing.stage_cost import FRAME, SKIPPED, STAGE
from studies.runs.recipes import TetrahedralBody
from tests.studies.tiny import tiny_case

HELD = TetrahedralBody(nodes=100)
"""Fewer do not keep the area where the ball is held."""
NO_CONTACT = "contact of nodes: no plane, sphere or capsule"


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
