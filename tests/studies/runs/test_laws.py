"""Stiffness laws on the meshes of the studies."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Volumes
from reference_fem import exact
from studies.base.errors import StudyError
from studies.meshing.scene_mesh import mesh_for
from studies.runs.case import Case
from studies.runs.prepare import body_for, prepare
from studies.runs.recipes import MembraneBody, TetrahedralBody
from studies.runs.run import measure
from studies.scene.library import BALL_SQUEEZE, BLADDER_FILL
from studies.scene.library.ball_squeeze import DEPTH, PRESS_END, RADIUS
from studies.store.record import Status


@pytest.fixture(scope="module")
def mesh():
    return mesh_for(BALL_SQUEEZE, 300)


def test_lloyd_overshoots_on_a_mesh_of_gmsh(mesh):
    """By about a fifth: 1.25 at 150 surface nodes, 1.22 at 300, 1.18 at 1,100; matched it does not."""
    mu = BALL_SQUEEZE.tissue.shear_modulus
    modulus = {}
    for law in ("lloyd", "lloyd_matched", "van_gelder"):
        springs = body_for(BALL_SQUEEZE, TetrahedralBody(nodes=300, law=law), mesh).springs
        modulus[law] = float(springs.stiffness @ springs.rest_length**2) / (15 * mesh.volume * mu)
    assert modulus["lloyd"] == pytest.approx(1.2, abs=0.05)  # the spread over meshes
    assert modulus["lloyd_matched"] == pytest.approx(1.0, rel=1e-9)
    assert modulus["van_gelder"] == pytest.approx(1.0, rel=1e-9)


def test_the_cotangent_law_is_built_with_its_volumes_and_recorded(mesh):
    case = Case(BALL_SQUEEZE, TetrahedralBody(nodes=150, law="cotangent", volumes="nodal"), frames=20)
    prepared = prepare(case)
    assert prepared.setup.body.rest_pressure == BALL_SQUEEZE.tissue.shear_modulus
    record = measure(case.replaced(scene=replace(BALL_SQUEEZE, reference=None)))
    assert record.attributes["law"] == "cotangent"


def test_an_unknown_law_is_refused_with_the_nearest():
    with pytest.raises(StudyError, match="unknown stiffness law 'van_geldr'; did you mean 'van_gelder'"):
        TetrahedralBody(law="van_geldr")


def test_without_them_the_run_fails_with_a_sentence():
    record = measure(Case(BALL_SQUEEZE, TetrahedralBody(nodes=150, law="cotangent"), frames=20))
    assert record.status == Status.FAILED and "keep one volume per node" in record.message


def test_stiffness_moves_the_rest_pressure_with_the_springs(mesh):
    body = body_for(BALL_SQUEEZE, TetrahedralBody(nodes=300, law="cotangent", volumes="nodal", stiffness=2.0), mesh)
    assert body.rest_pressure == 2 * BALL_SQUEEZE.tissue.shear_modulus
    assert body.kept.count == Volumes.nodal(body).count


@pytest.mark.campaign
def test_a_hollow_organ_can_be_a_membrane():
    """As thick as the wall is in the mean, as heavy as wall and content, filled like the organ."""
    case = Case(BLADDER_FILL, MembraneBody(nodes=400, law="delingette"), frames=20)
    prepared = prepare(case)
    body, mesh = prepared.setup.body, mesh_for(BLADDER_FILL, 400)
    assert body.mass.sum() == pytest.approx(BLADDER_FILL.tissue.density * mesh.outer_volume, rel=1e-2)
    assert body.node_count == mesh.outer_count and len(body.membrane.triangles) == len(body.triangles)
    assert case.name == "bladder_fill-membrane-400-implicit_volume-dt0.5-delingette"
    (name, ramp), grown = next(iter(prepared.setup.targets.items())), mesh.lumen_volume / mesh.outer_volume
    assert name == "whole" and ramp.values[-1] == pytest.approx(1 + 0.2 * grown, rel=1e-9)


def test_a_membrane_needs_a_wall():
    record = measure(Case(BALL_SQUEEZE, MembraneBody(nodes=400), frames=20))
    assert record.status == Status.FAILED and "solid organ" in record.message


def force_errors(nodes: int) -> np.ndarray:
    """Relative errors of the plate force of springs without length, from a tenth to 0.3 of the diameter."""
    record = measure(Case(BALL_SQUEEZE, TetrahedralBody(nodes=nodes, law="cotangent", volumes="nodal")))
    assert record.status == Status.OK
    t, force = record.fields["t"].values, record.fields["contact_force"].values[:, 0, 2]
    unit = BALL_SQUEEZE.tissue.shear_modulus * RADIUS**2
    shares = (0.10, 0.15, 0.20, 0.25, 0.30)
    frames = [int(np.argmin(np.abs(t - PRESS_END * share / DEPTH))) for share in shares]
    truth = np.array([exact.BALL_BETWEEN_PLANES[share][0] for share in shares])
    return np.abs(force[frames]) / (unit * truth) - 1


@pytest.mark.slow
def test_springs_without_length_press_as_the_incompressible_ball():
    """Against the axisymmetric solution (oracle 5): within 25 %, and better on the finer mesh.

    Measured: 5 to 10 % above it with 150 surface nodes, 2.5 to 4.5 % with 300, where one volume leaves −40 %.
    """
    coarse, fine = force_errors(150), force_errors(300)
    assert np.abs(coarse).max() < 0.25 and np.abs(fine).max() < 0.06
    assert np.abs(fine).mean() < 0.6 * np.abs(coarse).mean()
