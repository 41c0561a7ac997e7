"""The stress campaign as a whole: every trial once, even if a process dies; its table, chart and command."""

import os

import pandas as pd
import pytest

from studies.plots.campaigns.breaking import LOOKS, draw
from studies.tools.fuzz import campaign
from studies.tools.fuzz.campaign import counts, run_trials, table_of
from studies.tools.fuzz.outcome import UNEXPLAINED, Outcome
from studies.tools.fuzz.trial import draw as drawn

DEADLY = 1


def deadly(attempt, trials):
    """One trial takes its process with it."""
    if any(trial.number == DEADLY for trial in trials):
        os._exit(9)
    return [Outcome(trial, "ok", "", 0.0) for trial in trials]


@pytest.mark.campaign
def test_a_process_that_dies_costs_its_trial_alone(monkeypatch):
    monkeypatch.setattr(campaign, "CHUNK", 2)
    monkeypatch.setattr(campaign, "try_all", deadly)
    reports = []
    outcomes = run_trials([drawn(0, number) for number in range(4)], 2, reports.append)
    assert [outcome.trial.number for outcome in outcomes] == list(range(4)) and len(reports) == 4
    assert [outcome.trial.number for outcome in outcomes if outcome.status == UNEXPLAINED] == [DEADLY]
    assert "died" in outcomes[DEADLY].message


def test_the_table_counts_every_trial():
    rows = [Outcome(drawn(0, k), "ok" if k % 3 else "diverged", "", 0.1) for k in range(30)]
    table = counts(table_of(rows))
    assert table.loc["all", "all"] == 30 and table.loc["all", "diverged"] == 10
    assert next(iter(table)) == "ok" and list(table)[-1] == "all"


def test_the_chart_draws_every_status_and_none(tmp_path):
    rows = table_of(Outcome(drawn(0, k), list(LOOKS)[k % len(LOOKS)], "", 0.1) for k in range(300))
    draw(rows, tmp_path / "all.png")
    draw(pd.DataFrame(rows.assign(status="refused")), tmp_path / "none.png")
    assert (tmp_path / "all.png").stat().st_size > 20_000 and (tmp_path / "none.png").is_file()


@pytest.mark.slow
def test_the_command_tells_and_writes(organbench, tmp_path):
    code, out, err = organbench("fuzz", "--cases", 4, "--seed", 11, "--jobs", 1, "--results", tmp_path)
    assert code == 0, out + err
    assert len(pd.read_csv(tmp_path / "breaking" / "trials.csv.gz")) == 4
    assert (tmp_path / "breaking" / "breaking.png").is_file() and "all" in out
    code, again, _ = organbench("fuzz", "--seed", 11, "--trial", 2, "--results", tmp_path)
    status = pd.read_csv(tmp_path / "breaking" / "trials.csv.gz")["status"][2]
    assert code == 0 and again.startswith(f"{status}: ") and "--seed 11 --trial 2" in again and "simplest: " in again
