"""The stability limit is predicted, then shown by a run on either side of it."""

from dataclasses import replace

import pytest

from massspring import METHODS, StepLimit, Xpbd, XpbdNeoHookean
from studies.runs import safe_dt as module
from studies.runs.case import Case
from studies.runs.prepare import prepare
from studies.runs.recipes import QuadraticBody, TetrahedralBody
from studies.runs.safe_dt import ABOVE, BELOW, SafeStep, safe_step
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.store.record import Status

UNLIMITED = [method for method in METHODS if not method().capabilities.conditionally_stable]
SHORT = replace(BALL_SQUEEZE, reference=None, duration=1.0, checkpoints=(1.0,))
RECIPES = {"points": QuadraticBody(594), "elements": TetrahedralBody(nodes=60, law="cotangent", volumes="nodal")}


def recipe_for(method):
    """A small body that the method advances."""
    return RECIPES.get(method.capabilities.keeps, TetrahedralBody(60))


@pytest.mark.parametrize("method", [m for m in METHODS if m not in UNLIMITED], ids=lambda method: method.name)
def test_below_holds_and_above_breaks(method):
    step = safe_step(Case(SHORT, recipe_for(method), method()))
    if method is XpbdNeoHookean:  # its springs are replaced by constraints: nothing tried broke it
        assert {status for _, status in step.trials} == {Status.OK} and step.trials[-1][0] > 2 * step.limit.damped
        return
    if method is Xpbd:
        # The volumes of all cells take the stiffest modes away: the limit is longer than that of the springs.
        assert step.bracket is not None and step.limit.damped < step.bracket[1] and step.trials[0][1] == Status.OK
        return
    assert step.verified
    (below, calm), (above, wild) = step.trials
    # Rounding to whole steps, a hundred to a frame, moves the step by 1 % at most, and never up.
    assert 0.99 * BELOW <= below / step.limit.damped <= BELOW * (1 + 1e-9)
    assert 0.99 * ABOVE <= above / step.limit.damped <= ABOVE * (1 + 1e-9)
    assert (calm, wild) == (Status.OK, Status.DIVERGED)
    assert step.auto <= 0.5 * step.limit.damped


@pytest.mark.parametrize("method", UNLIMITED, ids=lambda method: method.name)
def test_a_method_without_a_limit_says_so(method):
    """Twenty times the explicit limit, and the run holds; a claim that fails is not verified."""
    step = safe_step(Case(SHORT, recipe_for(method), method()))
    assert step.verified and "no stability limit" in step.verdict and "accuracy" in step.verdict
    assert step.trials[-1][0] > 15 * step.limit.damped
    assert not replace(step, trials=((0.1, Status.DIVERGED),)).verified


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
    assert SafeStep(StepLimit(2.0, 0.0), 0.5, ((0.95, below), (1.1, above))).verified == verified


@pytest.mark.parametrize("wrong", [0.5, 1.5])
def test_a_wrong_prediction_is_not_verified_and_the_bracket_holds_the_true_limit(monkeypatch, wrong):
    """Mutants that predict half the limit, or one and a half of it: the bracket is where the true one is."""
    right = prepare(Case(SHORT, TetrahedralBody(60))).limit

    def mutant(case):
        preparation = prepare(case)
        return replace(preparation, limit=StepLimit(preparation.limit.frequency / wrong, preparation.limit.damping))

    monkeypatch.setattr(module, "prepare", mutant)
    step = safe_step(Case(SHORT, TetrahedralBody(60)))
    assert not step.verified and ("longer" if wrong < 1 else "shorter") in step.verdict
    below, above = step.bracket
    assert below < right.damped < above
    # One run to the next is a factor of 1.25, or 1.1/0.95 in the middle; whole steps take up to 1 %.
    assert above / below < 1.27


@pytest.mark.parametrize("volumes", ["whole", "regions", "nodal"])
def test_constraints_never_shorten_the_limit(volumes):
    """Cauchy interlacing: volumes take modes away. A few leave the stiffest mode as it is, one per node does not."""
    step = safe_step(Case(SHORT, TetrahedralBody(60, volumes=volumes, regions=4)))
    assert step.bracket[1] > step.limit.damped
    assert step.verified == (volumes != "nodal")
    assert ("longer than predicted" in step.verdict) == (not step.verified)


def test_a_limit_that_no_run_shows_has_no_bracket():
    calm = SafeStep(StepLimit(2.0, 0.0), 0.5, ((0.95, Status.OK), (1.1, Status.OK)))
    assert calm.bracket is None and "no stable step" in calm.verdict
    assert calm.margin == pytest.approx(2.0)
