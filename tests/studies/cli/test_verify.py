"""`organbench verify`: what it prints, writes and returns."""

import math

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from reference_fem import SolveError
from reference_fem.oracles import Check, Curve, Oracle, Outcome, kappa
from studies.cli import app as cli
from studies.tools.verify import verification


def oracle(name, value, fast=True, **options):
    check = Check("force", "N", 2.0, value, 0.01, "block, 48 P2/P1", 402, **options)
    curve = Curve("error of u", name, (0.5, 0.25), (0.1, 0.0125))
    return Oracle(name, f"Title of {name}", "closed form", lambda: Outcome((check,), (curve,)), fast)


@pytest.fixture
def run(monkeypatch, tmp_path):
    def invoke(pack, *words, judges=()):
        monkeypatch.setattr(verification, "ORACLES", tuple(pack))
        monkeypatch.setattr(verification, "second_judges", lambda root: tuple(judges))
        monkeypatch.setattr(verification.kappa, "dependence", lambda: {"force": 1.0 + 1.0 / np.array(kappa.RATIOS)})
        return CliRunner().invoke(cli.app, ["verify", "--results", str(tmp_path), *words])

    return invoke


def test_numbers_that_agree_are_printed_and_kept(run, tmp_path):
    result = run([oracle("first", 2.01), oracle("second", 1.99, fast=False)])
    assert result.exit_code == 0
    assert "2 of 2 checks passed" in result.stdout
    table = pd.read_csv(tmp_path / "verify" / "verify.csv")
    assert list(table["oracle"]) == ["first", "second"]
    assert list(table["deviation"]) == pytest.approx([0.005, 0.005])
    assert set(table["met"]) == {"yes"}
    words = (tmp_path / "verify" / "verify.md").read_text()
    assert "Title of second" in words
    assert "402 unknowns" in words
    assert (tmp_path / "verify" / "convergence.png").stat().st_size > 10_000
    assert list(pd.read_csv(tmp_path / "verify" / "kappa.csv")["kappa/mu"]) == list(kappa.RATIOS)


@pytest.mark.parametrize("value", [2.1, math.nan])
def test_a_number_that_is_off_fails_the_command(run, tmp_path, value):
    result = run([oracle("right", 2.0), oracle("wrong", value)])
    assert result.exit_code == 1
    assert "off: wrong: force" in result.stdout
    assert list(pd.read_csv(tmp_path / "verify" / "verify.csv")["met"]) == ["yes", "NO"]


def test_a_control_that_agrees_fails_the_command(run):
    assert run([oracle("control", 2.0, kind="misses")]).exit_code == 1
    assert run([oracle("control", 3.0, kind="misses")]).exit_code == 0


def test_the_fast_half_leaves_the_whole_alone(run, tmp_path):
    slow = Oracle("slow", "Slow", "a book", lambda: pytest.fail("the slow half must not run"), fast=False)
    result = run([slow, oracle("quick", 2.0)], "--fast")
    assert result.exit_code == 0
    assert not (tmp_path / "verify").exists()
    assert list(pd.read_csv(tmp_path / "smoke" / "verify" / "verify.csv")["oracle"]) == ["quick"]


def test_an_oracle_that_cannot_be_solved_fails_without_silencing_the_others(run, tmp_path):
    def break_off():
        raise SolveError("no equilibrium found between t = 0 s and t = 1 s")

    result = run([Oracle("stuck", "Stuck", "a book", break_off), oracle("right", 2.0)])
    assert result.exit_code == 1
    assert "off: stuck: not solved: no equilibrium found" in result.stdout
    assert list(pd.read_csv(tmp_path / "verify" / "verify.csv")["met"]) == ["NO", "yes"]


def test_a_reference_that_its_second_judge_contradicts_fails_the_command(run, tmp_path):
    result = run([oracle("right", 2.0)], judges=[oracle("judge", 2.1, fast=False)])
    assert result.exit_code == 1
    assert "off: judge: force" in result.stdout
    assert list(pd.read_csv(tmp_path / "verify" / "verify.csv")["oracle"]) == ["right", "judge"]
