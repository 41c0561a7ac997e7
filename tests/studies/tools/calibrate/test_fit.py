"""Least squares over few runs, held to closed forms."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from massspring.body.build import SURFACE_WEIGHTS
from studies.base.errors import StudyError
from studies.metrics.run import Run
from studies.runs.case import BodyRecipe, Case
from studies.runs.run import measure
from studies.scene.library import BALL_CLAMPED, BALL_SQUEEZE
from studies.store.ledger import Ledger
from studies.tools.calibrate.fit import DIFFERENCE, fit
from studies.tools.calibrate.measured import Measurements
from studies.tools.calibrate.parameters import INNER_WEIGHT, STIFFNESS, parameters_of, scaled, weights_of
from tests.campaigns import campaign
from tests.studies.tiny import NODES, SQUEEZE
from tests.studies.tools.calibrate import made_up_errors
from tests.studies.tools.calibrate.made_up_errors import judged

SOLID = BodyRecipe(nodes=NODES)
SURFACE = BodyRecipe("surface", NODES)


class Formula:
    """Errors by formula, and the pairs of scene and recipe that they would have run."""

    def __init__(self, of):
        self.of, self.pairs = of, set()

    def __call__(self, scene, recipe):
        self.pairs.add((scene.name, recipe))
        return self.of(scene, recipe)


@pytest.mark.parametrize("truth", [0.05, 0.7, 1.0, 1.35, 9.0])
def test_a_force_in_proportion_to_the_stiffness_gives_its_factor(truth):
    errors = Formula(lambda scene, recipe: judged(scene, recipe, 100 * (recipe.stiffness / truth - 1), 4.0))
    fitted = fit(SOLID, [BALL_CLAMPED], errors)
    assert fitted.recipe.stiffness == pytest.approx(truth, rel=2e-3) and fitted.converged and not fitted.at_bound
    assert len(errors.pairs) < 25


def test_two_scenes_meet_at_the_least_squares():
    """Forces s/a and s/b: the sum of squares of s/a - 1 and s/b - 1 is least at s = (1/a + 1/b)/(1/a^2 + 1/b^2)."""
    a, b = 1.5, 1.2
    truth = {BALL_CLAMPED.name: a, BALL_SQUEEZE.name: b}

    def errors(scene, recipe):
        return judged(scene, recipe, 100 * (recipe.stiffness / truth[scene.name] - 1))

    fitted = fit(SOLID, [BALL_CLAMPED, BALL_SQUEEZE], errors)
    assert fitted.recipe.stiffness == pytest.approx((1 / a + 1 / b) / (1 / a**2 + 1 / b**2), rel=1e-3)


def bowl(scene, recipe):
    """Least where stiffness is 2 and inner springs are a quarter as stiff as structural ones."""
    inner = math.log(weights_of(recipe)[2] / 0.25)
    force = 100 * (0.5 * recipe.stiffness * (1 + 0.2 * inner) - 1)
    return judged(scene, recipe, force, math.hypot(3.0, 5 * inner))


def test_the_paper_s_body_has_two_numbers_to_fit():
    fitted = fit(SURFACE, [BALL_CLAMPED], errors := Formula(bowl))
    assert fitted.recipe.stiffness == pytest.approx(2.0, rel=0.01)
    assert fitted.recipe.weights == pytest.approx((1.0, 0.5, 0.25, 1.0), rel=0.6 * DIFFERENCE)
    assert fitted.parameters == (STIFFNESS, INNER_WEIGHT) and len(errors.pairs) < 30


def test_no_more_numbers_are_fitted_than_errors_are_compared():
    fitted = fit(SURFACE, [BALL_SQUEEZE], lambda scene, recipe: judged(scene, recipe, 50 * recipe.stiffness - 100))
    assert fitted.parameters == (STIFFNESS,) and fitted.recipe.weights is None
    assert fitted.recipe.stiffness == pytest.approx(2.0, rel=1e-3)


def test_a_goal_is_no_finer_than_the_bar_of_the_reference(monkeypatch):
    """Displacement wants 1.2, force 1.0: weights of 1 and 1/9, where bars of 0.5 % leave the goals of 1 and 3 %,
    and of 1/36 and 1/36 where both bars are 6 %."""

    def errors(scene, recipe):
        return judged(scene, recipe, 100 * (recipe.stiffness - 1), 100 * (recipe.stiffness - 1.2))

    fitted = fit(SOLID, [BALL_CLAMPED], errors)
    assert fitted.recipe.stiffness == pytest.approx((1 / 9 + 1.2) / (1 / 9 + 1), rel=2e-3)
    monkeypatch.setattr(made_up_errors, "UNCERTAINTY", 6.0)
    assert fit(SOLID, [BALL_CLAMPED], errors).recipe.stiffness == pytest.approx(1.1, rel=2e-3)


def test_the_search_turns_back_from_a_body_that_breaks():
    def errors(scene, recipe):
        return None if recipe.stiffness > 2.2 else judged(scene, recipe, 100 * (recipe.stiffness / 2.0 - 1))

    assert fit(SOLID, [BALL_CLAMPED], errors).recipe.stiffness == pytest.approx(2.0, rel=0.01)


def test_the_end_of_the_range_is_named():
    fitted = fit(SOLID, [BALL_CLAMPED], lambda scene, recipe: judged(scene, recipe, 100 * (recipe.stiffness / 300 - 1)))
    assert fitted.at_bound == ("stiffness",) and 90.0 < fitted.recipe.stiffness <= 100.0


@pytest.mark.parametrize("body", [SOLID, campaign(SURFACE)], ids=["tetrahedral", "surface"])
def test_springs_half_as_stiff_are_fitted_back(tmp_path, body):
    """The truth is the force of the same body with its full stiffness, which runs measure: nothing is assumed of how
    forces grow with it."""
    case = Case(SQUEEZE, body, frames=None)
    whole = Run(case, measure(case))
    reference = SimpleNamespace(force=whole.force[whole.checkpoint_frames], total_uncertainty={"force_end": 0.01})
    runs = Measurements(Ledger(tmp_path), ())
    runs.references[SQUEEZE.name] = reference  # type: ignore[assignment]
    soft = scaled(body, (STIFFNESS,), (0.5,))
    assert soft.stiffness == 0.5
    fitted = fit(soft, [SQUEEZE], runs.errors)
    assert fitted.recipe.stiffness == pytest.approx(1.0, rel=0.01)
    assert 3 <= runs.made <= 12


def test_a_parameter_says_what_the_recipe_holds():
    weights = np.array(list(SURFACE_WEIGHTS.values()))
    assert INNER_WEIGHT.read(SURFACE) == weights[2]
    changed = scaled(SURFACE, parameters_of(SURFACE), (3.0, 0.123456789))
    assert changed.stiffness == 3.0 and changed.weights == (1.0, 0.5, 0.06173, 1.0)
    assert scaled(SURFACE, parameters_of(SURFACE), (1.0, 1.0)) == SURFACE


@pytest.mark.parametrize(
    ("recipe", "message"),
    [
        (BodyRecipe("quadratic", 594), "unknown body for a calibration 'quadratic'"),
        (BodyRecipe("membrane", law="lloyd"), "unknown body for a calibration 'membrane'"),
        (BodyRecipe(volumes="regions"), "volumes 'regions' is not calibrated"),
        (BodyRecipe(law="cotangent", volumes="nodal"), "volumes 'nodal' is not calibrated"),
    ],
)
def test_what_has_a_better_element_is_not_calibrated(recipe, message):
    with pytest.raises(StudyError, match=message):
        parameters_of(recipe)
