"""The stability limit is predicted, then shown by a run on either side of it."""

from dataclasses import replace

import pytest

from massspring import METHODS
from studies import safe_dt as module
from studies.case import BodyRecipe, Case
from studies.errors import StudyError
from studies.safe_dt import ABOVE, BELOW, SafeStep, safe_step
from studies.scenes.ball_squeeze import BALL_SQUEEZE
from studies.store import Status
from tests.studies.tiny import tiny_case

SHORT = replace(BALL_SQUEEZE, reference=None, duration=1.0, checkpoints=(1.0,))


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_below_holds_and_above_breaks(method):
    found = safe_step(Case(SHORT, BodyRecipe("tetrahedral", 60), method()))
    assert found.verified
    (below, calm), (above, wild) = found.tried
    # Rounding to whole steps, a hundred to a frame, moves the step by 1 % at most, and never up.
    assert 0.99 * BELOW <= below / found.limit.damped <= BELOW * (1 + 1e-9)
    assert 0.99 * ABOVE <= above / found.limit.damped <= ABOVE * (1 + 1e-9)
    assert (calm, wild) == (Status.OK, Status.DIVERGED)
    assert found.auto <= 0.5 * found.limit.damped


def test_stiffer_means_shorter():
    """Frequencies go with the root of the stiffness: four times stiffer, half the step."""
    soft, stiff = (safe_step(Case(SHORT, BodyRecipe("tetrahedral", 60, stiffness=k))).limit for k in (1.0, 4.0))
    assert stiff.undamped == pytest.approx(0.5 * soft.undamped, rel=1e-6)


@pytest.mark.parametrize(
    ("below", "above", "verified"),
    [
        (Status.OK, Status.DIVERGED, True),
        (Status.INVERTED, Status.DIVERGED, True),
        (Status.OK, Status.OK, False),
        (Status.DIVERGED, Status.DIVERGED, False),
    ],
)
def test_what_counts_as_verified(below, above, verified):
    assert SafeStep(None, 1.0, ((0.95, below), (1.1, above))).verified == verified


def test_it_says_so_when_the_limit_is_elsewhere(monkeypatch):
    """A mutant that predicts half the limit is found out: the run above it is calm."""
    monkeypatch.setattr(module, "BELOW", 0.5 * BELOW)
    monkeypatch.setattr(module, "ABOVE", 0.5 * ABOVE)
    assert not safe_step(Case(SHORT, BodyRecipe("tetrahedral", 60))).verified


def test_what_cannot_be_prepared_is_told():
    with pytest.raises(StudyError, match="stiffness factor is -1"):
        safe_step(tiny_case(body=BodyRecipe(nodes=60, stiffness=-1.0)))
