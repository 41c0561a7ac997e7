"""A recipe that ran on five neighbouring meshes is judged by the worst of them."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import ImplicitElements, ImplicitVolume
from studies.metrics.judged import Judged, Measured, cheapest, over_meshes
from studies.metrics.wish import Wish
from studies.runs.case import Case
from studies.runs.recipes import QuadraticBody, TetrahedralBody, neighbours
from studies.scene.library import LIVER_PROBE

BODY = QuadraticBody(794)
FORCES, MEANS = (0.5, -4.0, 1.0, 2.0, 3.0), (0.2, 0.4, 0.3, 1.5, 0.1)
WISH = Wish(force=3.0, displacement=1.0)


def row(body, force, mean, cost=1.0, fraction=0.8, **more):
    case = Case(LIVER_PROBE, body, ImplicitVolume(), dt_fraction=fraction, **more)
    return Judged(case, Measured(force, 0.1), Measured(mean, 0.05), Measured(cost), shape=Measured(0.1 + mean))


def five(body=BODY, forces=FORCES, means=MEANS):
    return [row(*one) for one in zip(neighbours(body), forces, means, strict=True)]


def test_each_error_is_the_largest_with_its_sign_and_uncertainty():
    (one,) = over_meshes(five())
    assert one.case.body == BODY and [each.case.body.nodes for each in one.members] == [746, 770, 794, 818, 842]
    assert one.force == (-4.0, 0.1) and one.displacement == (1.5, 0.05) and one.shape.value == pytest.approx(1.6)
    assert one.median("force") == 2.0 and one.median("displacement") == 0.3


def test_a_recipe_that_is_right_on_four_meshes_is_not_recommended():
    good = five(forces=(1, 1, 1, 1, 1), means=(0.2,) * 5)
    lucky = five(replace(BODY, nodes=594), forces=(1, 1, 1, 1, 3.5), means=(0.2,) * 5)
    lucky = [replace(one, cost=Measured(0.1)) for one in lucky]
    assert cheapest(over_meshes([*lucky, *good]), WISH).case.body == BODY


def test_a_quadratic_recipe_on_one_mesh_is_no_answer_where_others_ran_on_five():
    single = row(replace(BODY, contact="nodes"), 0.1, 0.1, cost=0.01)
    linear = row(TetrahedralBody(nodes=550), 30.0, 10.0)
    rows = over_meshes([*five(), single, linear])
    assert [one.case.body for one in rows] == [BODY, linear.case.body]
    assert over_meshes([single, linear]) == [single, linear]  # alone it counts, with a remark


def test_other_methods_on_quadratic_elements_stay():
    """They run on one mesh, for comparison."""
    other = row(replace(BODY, nodes=294), 2.0, 0.5)
    other = replace(other, case=replace(other.case, method=ImplicitElements(), dt=0.01))
    assert [one.case.method.name for one in over_meshes([*five(), other])] == ["implicit_volume", "implicit_elements"]


def test_of_five_meshes_none_may_be_missing():
    """One of the five failed: four are no family."""
    broken, whole = five(replace(BODY, nodes=594))[:4], five()
    assert [one.case.body.nodes for one in over_meshes([*broken, *whole])] == [794]


def test_other_steps_are_other_recipes_and_recording_is_none():
    half = [replace(one, case=replace(one.case, dt_fraction=0.4)) for one in five()]
    recorded = five()
    recorded[2] = replace(recorded[2], case=replace(recorded[2].case, recorded=("surface",)))
    assert [one.case.dt_fraction for one in over_meshes([*half, *recorded])] == [0.4, 0.8]


def test_what_is_not_compared_stays_unknown():
    silent = [replace(one, force=Measured(np.nan)) for one in five()]
    (one,) = over_meshes(silent)
    assert not one.force.known and one.displacement.value == 1.5
