"""The force of an instrument thinner than the facets of a whole organ (docs/limits.md)."""

from dataclasses import replace

import pytest

from massspring import Sphere, Trajectory
from studies import Case, ForceOutput, ImplicitVolume, QuadraticBody, ReferencePlan, measure, solve_reference
from studies.scene.library import BALL_CLAMPED
from studies.store.record import Status

pytestmark = pytest.mark.campaign


@pytest.mark.parametrize(
    ("radius", "depth", "nodes", "within"), [(0.005, 0.008, 594, 0.035), (0.0025, 0.003, 994, 0.03)]
)
def test_adaptive_bodies_press_a_thin_sphere_as_the_reference_does(mesh_cache, tmp_path, radius, depth, nodes, within):
    """A uniform body of 594 nodes has a quarter too much force under 5 mm, and is refused under 2.5 mm."""
    top = (0.0, 0.0, BALL_CLAMPED.organ.parameters["radius"] + radius)
    sphere = Sphere(top, radius, Trajectory((0.0, 2.0), ((0.0, 0.0, 0.0), (0.0, 0.0, -depth))))
    scene = replace(
        BALL_CLAMPED,
        name="thin_tool",
        held=BALL_CLAMPED.held[:1],
        obstacles=(sphere,),
        duration=3.0,
        checkpoints=(3.0,),
        probed=ForceOutput("obstacle", 0, (0.0, 0.0, -1.0)),
        reference=ReferencePlan(),
    )
    truth, coarser = solve_reference(tmp_path, scene).field("sample_force")[:2, 0]
    assert abs(coarser / truth - 1.0) < 0.01
    ends = []
    for graded in ("adaptive", False):
        body = QuadraticBody(nodes, graded=graded, mass="stiffness")
        record = measure(Case(replace(scene, reference=None), body, ImplicitVolume(), frames=60))
        ends.append((record.status, None if record.status == Status.FAILED else record.fields["contact_force"].values))
    (status, force), (other, coarse) = ends
    assert status == Status.OK and abs(-force[-1, 0, 2] / truth - 1.0) < within
    assert other == Status.FAILED if radius < 0.005 else abs(-coarse[-1, 0, 2] / truth - 1.0) > 0.15
