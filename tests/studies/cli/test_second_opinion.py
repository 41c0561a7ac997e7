"""The organ of the second opinion, and what is left without the other code."""

import numpy as np
import pytest

from reference_fem import crosscheck, nodes
from reference_fem.model.problem import find_held
from studies.scene.library import BALL_INCISED
from studies.tools.verify.second_opinion import PULL, incised_ball, pulled_liver, second_opinions


def test_without_the_other_code_there_is_no_second_opinion(monkeypatch):
    monkeypatch.setattr(crosscheck, "available", lambda: False)
    assert second_opinions() == ()


def test_the_liver_is_attached_and_pulled_outward():
    """The two patches lie apart, and the grip moves by PULL."""
    problem = pulled_liver()
    grip, attached = find_held(problem)
    assert len(grip.nodes) > 10
    assert len(attached.nodes) > 10
    assert not np.intersect1d(grip.nodes, attached.nodes).size
    np.testing.assert_allclose(np.linalg.norm(grip.displacement(1.0), axis=0), PULL, rtol=1e-12)


def test_the_ball_is_cut_and_held_at_its_caps():
    """Nodes of the cut are there twice, on the plane and behind the front; the pull is the scene's at its end."""
    problem = incised_ball()
    x = nodes(problem.mesh)
    places, count = np.unique(np.round(x, 9), axis=0, return_counts=True)
    parted = places[count == 2]
    assert len(parted) > 20 and set(count) == {1, 2}
    np.testing.assert_allclose(parted[:, 2], 0.0, atol=1e-9)
    assert parted[:, 0].max() < 0.0
    top, bottom = find_held(problem)
    assert x[top.nodes, 2].min() > 0.03 and x[bottom.nodes, 2].max() < -0.03
    np.testing.assert_allclose(top.displacement(1.0)[:, 0], BALL_INCISED.held[1].path(4.0), rtol=1e-12)


@pytest.mark.slow
@pytest.mark.skipif(not crosscheck.available(), reason="NGSolve is not installed: pip install organbench[crosscheck]")
@pytest.mark.parametrize("which", [2, 3], ids=["liver", "cut ball"])
def test_both_codes_agree_on_organs(which):
    checks = second_opinions()[which].measure().checks
    assert all(check.met for check in checks)
    assert checks[0].expected > 0.1
