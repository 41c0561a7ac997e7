"""Bodies on graded and quadratic meshes have the mass, volume and held region of their scene."""

import numpy as np
import pytest

from studies.base.errors import DoesNotApply
from studies.runs.case import Case
from studies.runs.prepare import prepare
from studies.runs.recipes import QuadraticBody, TetrahedralBody
from studies.scene.library.ball_clamped import BALL_CLAMPED, CAP, RADIUS
from studies.scene.library.ball_ringing import BALL_RINGING
from studies.scene.library.bladder_fill import BLADDER_FILL

BALL = 4 / 3 * np.pi * RADIUS**3


def held_nodes(prepared):
    return [attachment.nodes for attachment in prepared.setup.attachments]


def test_a_graded_body_holds_the_nodes_of_its_caps_and_has_the_surface_nodes_of_its_recipe(mesh_cache):
    prepared = prepare(Case(BALL_CLAMPED, TetrahedralBody(nodes=300, graded=True)))
    rest, mesh = prepared.setup.body.rest, prepared.mesh
    assert abs(mesh.outer_count / 300 - 1) <= 0.05
    for nodes, sign in zip(held_nodes(prepared), (-1, 1), strict=True):
        assert (sign * rest[nodes, 2] >= CAP * RADIUS * (1 - 1e-9)).all() and len(nodes) > 10
    assert prepared.setup.body.mass.sum() == pytest.approx(BALL_CLAMPED.tissue.density * mesh.volume, rel=1e-9)
    even = prepare(Case(BALL_CLAMPED, TetrahedralBody(nodes=300)))
    assert all(len(ours) > len(theirs) for ours, theirs in zip(held_nodes(prepared), held_nodes(even), strict=True))


def test_masses_by_stiffness_are_refused_where_the_body_rings(mesh_cache):
    case = Case(BALL_RINGING, QuadraticBody(300, mass="stiffness"))
    with pytest.raises(DoesNotApply, match="masses by stiffness do not apply to scene 'ball_ringing': it starts"):
        prepare(case)


@pytest.mark.slow
def test_a_quadratic_body_is_as_large_and_heavy_as_the_ball(mesh_cache):
    prepared = prepare(Case(BALL_CLAMPED, QuadraticBody(600, mass="stiffness")))
    body, mesh = prepared.setup.body, prepared.mesh
    assert body.mass.sum() == pytest.approx(BALL_CLAMPED.tissue.density * BALL, rel=2e-3)
    assert body.rest_volumes.sum() == pytest.approx(BALL, rel=2e-3)
    # Four flat triangles to a facet cut off a sixteenth of what one would.
    assert mesh.volume == pytest.approx(BALL, rel=0.015)
    for nodes, sign in zip(held_nodes(prepared), (-1, 1), strict=True):
        assert (sign * body.rest[nodes, 2] >= CAP * RADIUS * (1 - 1e-9)).all()


@pytest.mark.campaign
def test_the_lumen_of_a_quadratic_bladder_is_its_last_volume_and_is_filled(mesh_cache):
    prepared = prepare(Case(BLADDER_FILL, QuadraticBody(800)))
    assert prepared.setup.body.kept.names[-1] == "lumen"
    assert list(prepared.setup.targets) == ["lumen"]
    assert prepared.mesh.lumen_volume == pytest.approx(prepared.setup.body.rest_volumes[-1], rel=1e-9)
