"""Signs of too coarse a contact: how many facets touch, and where the force points."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Plane
from studies.metrics.metrics import contact_facets, contact_turn
from studies.runs.recipes import TetrahedralBody
from studies.scene.scene import ForceOutput
from tests.studies import made_up_run

PUSH = (0.0, 0.0, -1.0)


def pressed(height, force=(0.0, 0.0, -2.0)):
    """The cube below a plane at `height` [m]; the body is where it is at rest."""
    made = made_up_run.run(
        values={"contact_force": np.tile(force, (4, 1, 1)), "snapshots": np.tile(made_up_run.POINTS, (2, 1, 1))}
    )
    scene = replace(
        made.case.scene,
        obstacles=(Plane((0.0, 0.0, height), PUSH),),
        probed=ForceOutput("obstacle", 0, PUSH),
    )
    return replace(made, case=replace(made.case, scene=scene, body=TetrahedralBody()))


def test_facets_are_counted_that_reach_the_plane():
    top = made_up_run.POINTS[:, 2].max()
    on_top = (made_up_run.POINTS[made_up_run.TRIANGLES][:, :, 2] == top).any(axis=1).sum()
    assert contact_facets(pressed(top)) == on_top > 0
    assert contact_facets(pressed(top + 0.01)) == 0
    assert contact_facets(pressed(top - 2 * made_up_run.EDGE)) == len(made_up_run.TRIANGLES)


@pytest.mark.parametrize("degrees", [0.0, 1.7, 30.0])
def test_the_force_is_turned_by_the_angle(degrees):
    angle = np.radians(degrees)
    assert contact_turn(pressed(0.1, (2 * np.sin(angle), 0.0, -2 * np.cos(angle)))) == pytest.approx(degrees, abs=1e-6)


def test_without_an_obstacle_there_is_neither():
    held = made_up_run.run()
    assert np.isnan(contact_facets(held)) and np.isnan(contact_turn(held))
    assert np.isnan(contact_turn(pressed(0.1, (0.0, 0.0, 0.0))))
