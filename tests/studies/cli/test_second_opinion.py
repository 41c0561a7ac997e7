"""The organ of the second opinion, and what is left without the other code."""

import numpy as np
import pytest

from reference_fem import crosscheck
from reference_fem.model.problem import find_held
from studies.tools.verify.second_opinion import PULL, pulled_liver, second_opinions


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


@pytest.mark.slow
@pytest.mark.skipif(not crosscheck.available(), reason="NGSolve is not installed: pip install organbench[crosscheck]")
def test_both_codes_agree_on_the_liver():
    checks = second_opinions()[2].measure().checks
    assert all(check.met for check in checks)
    assert checks[0].expected > 0.1
