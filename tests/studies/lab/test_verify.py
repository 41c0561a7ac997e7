"""The pack of the reference prints and keeps what it found, and a number that is off fails it; the problems of the
second code are solved here, and there where NGSolve is installed."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from reference_fem import NeoHookean, SolveError, equilibrium_path, nodes
from reference_fem.oracles import Check, Curve, Oracle, Outcome, kappa
from studies import LIVER_PROBE
from studies.lab.verify import __main__ as program
from studies.lab.verify import pack, second_opinion
from studies.lab.verify.ngsolve_code import available
from studies.lab.verify.second_opinion import AGREEMENT, opinion

pytestmark = pytest.mark.lab


def oracle(name, value, fast=True):
    check = Check("force", "N", 2.0, value, 0.01, "block, 48 P2/P1", 402)
    curve = Curve("error of u", name, (0.5, 0.25), (0.1, 0.0125))
    return Oracle(name, f"Title of {name}", "closed form", lambda: Outcome((check,), (curve,)), fast)


def stuck():
    raise SolveError("no equilibrium found")


def test_the_program(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(kappa, "dependence", lambda: {"force": 1.0 + 1.0 / np.array(kappa.RATIOS)})
    monkeypatch.setattr(pack, "second_opinions", lambda: ())
    words = ["--results", str(tmp_path)]
    monkeypatch.setattr(pack, "ORACLES", (oracle("first", 2.01), oracle("slow", 1.99, fast=False)))
    assert program.main(words) == 0 and "2 of 2 checks passed" in capsys.readouterr().out
    assert list(pd.read_csv(tmp_path / "verify" / "verify.csv")["deviation"]) == pytest.approx([0.005, 0.005])
    assert {"convergence.png", "kappa.csv", "kappa.png", "verify.csv", "verify.md"} == {
        path.name for path in (tmp_path / "verify").iterdir()
    }
    monkeypatch.setattr(
        pack, "ORACLES", (oracle("first", 2.01), oracle("wrong", 2.1), Oracle("stuck", "", "a book", stuck))
    )
    assert program.main([*words, "--fast"]) == 1
    table = pd.read_csv(tmp_path / "smoke" / "verify" / "verify.csv").set_index("oracle")
    assert table["met"].to_dict() == {"first": "yes", "wrong": "NO", "stuck": "NO"}


@pytest.mark.parametrize(
    "problem",
    [second_opinion.clamped_ball(3), second_opinion.incised_ball(3), second_opinion.thick_sphere(3, 2)],
    ids=["ball", "cut ball", "sphere"],
)
def test_both_codes_agree(problem):
    """And another bulk modulus, by a hundredth, would show."""
    ours = equilibrium_path(problem, (0.5, 1.0))[-1]
    assert np.linalg.norm(ours.held_force[0]) > 0.1
    if not available():
        pytest.skip("NGSolve is not installed: pip install organbench[crosscheck]")
    assert all(check.met for check in opinion(problem, "small"))
    harder = replace(problem, material=NeoHookean(problem.material.mu, 1.01 * problem.material.kappa))
    theirs = second_opinion.solve(harder, second_opinion.STEPS)
    assert np.abs(ours.p - theirs.p).max() > 100.0 * AGREEMENT * np.abs(theirs.p).max()


def test_the_liver_is_pulled_where_the_probe_touches_it():
    problem = second_opinion.pulled_liver()
    x = nodes(problem.mesh)
    grip, attached = (held.where(x.T) for held in problem.held)
    assert grip.sum() > 10 and attached.sum() > 10 and not (grip & attached).any()
    assert np.linalg.norm(x[grip].mean(axis=0) - LIVER_PROBE.obstacles[0].centre) < 0.03
    assert np.linalg.norm(problem.held[0].motion(1.0)) == pytest.approx(second_opinion.PULL)
