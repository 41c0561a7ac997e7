"""Elements are small where a thin tool comes, so that it presses the body in place of slipping through."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Capsule, Plane, Sphere, Trajectory
from studies.meshing.bounds import REFERENCE_UNDER_TOOL, UNDER_TOOL
from studies.meshing.held_mesh import held_mesh
from studies.meshing.moving_tools import fine_under_tools, moments_of
from studies.meshing.scene_mesh import mesh_for
from studies.scene.library import BALL_CLAMPED, KIDNEY_PROBE, LIVER_PROBE, STOMACH_PROBE

RADIUS = 0.003
IN, OUT = (Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), (step, 0.0, 0.0))) for step in (-0.008, 0.008))


@pytest.fixture(scope="module")
def ball(mesh_cache):
    return held_mesh(BALL_CLAMPED, mesh_for(BALL_CLAMPED, 200))


def with_tool(ball, path, kind=Sphere):
    """A tool that touches the ball at its largest x at rest."""
    start = (float(ball.mesh.p[0].max()) + RADIUS, 0.0, 0.0)
    if kind is Plane:
        tool = Plane(start, (-1.0, 0.0, 0.0), path)
    elif kind is Capsule:
        tool = Capsule(start, (start[0] + 0.05, 0.0, 0.0), RADIUS, path)
    else:
        tool = Sphere(start, RADIUS, path)
    return replace(BALL_CLAMPED, obstacles=(tool,))


def nearest(a, b, c, point):
    """Distance of a triangle from a point, by a fine lattice of its points."""
    s = np.linspace(0.0, 1.0, 41)
    u, v = (part[np.add.outer(s, s) <= 1.0] for part in np.meshgrid(s, s, indexing="ij"))
    return np.linalg.norm(a + u[:, None] * (b - a) + v[:, None] * (c - a) - point, axis=1).min()


@pytest.mark.parametrize("kind", [Sphere, Capsule])
def test_facets_under_a_tool_are_at_most_2_5_radii_wide(ball, kind):
    scene = with_tool(ball, IN, kind)
    fine = fine_under_tools(scene, ball, UNDER_TOOL)
    (tool,) = scene.obstacles
    start = np.array(tool.start if kind is Capsule else tool.centre)
    widest = []
    for mesh in (ball.mesh, fine.mesh):
        triangles = mesh.p.T[mesh.facets.T[mesh.boundary_facets()]]
        middles = [start + x for x in tool.path(np.linspace(0.0, 1.0, 9))]
        met = [t for t in triangles if min(nearest(*t, m) for m in middles) < RADIUS]
        widest.append(max(np.linalg.norm(t - np.roll(t, 1, axis=0), axis=1).max() for t in met) / RADIUS)
    assert widest[0] > 2.0 * UNDER_TOOL and widest[1] <= UNDER_TOOL
    assert fine.mesh.nelements < 2 * ball.mesh.nelements, "the rest stays as it is"


@pytest.mark.parametrize(("path", "kind"), [(OUT, Sphere), (IN, Plane)])
def test_what_no_thin_tool_comes_to_stays_as_it_is(ball, path, kind):
    assert fine_under_tools(with_tool(ball, path, kind), ball, UNDER_TOOL) is ball


@pytest.mark.parametrize("scene", [LIVER_PROBE, KIDNEY_PROBE, STOMACH_PROBE], ids=lambda scene: scene.name)
def test_references_under_fingertips_stay_as_they_are(scene, mesh_cache):
    body = held_mesh(scene, mesh_for(scene, scene.reference.base, on_shape=True))
    body = body.refined(scene, 0, scene.reference.at_contact)
    assert fine_under_tools(scene, body, REFERENCE_UNDER_TOOL) is body


def test_moments_leave_no_gap_wider_than_half_the_radius():
    path = Trajectory((0.0, 1.0, 1.5, 4.0), ((0.0, 0.0, 0.0), (0.02, 0.0, 0.0), (0.02, 0.0, 0.0), (0.0, 0.01, 0.0)))
    times = moments_of(Sphere((0.0, 0.0, 0.0), 0.003, path))
    assert set(path.times) <= set(times) and times == sorted(set(times))
    assert np.linalg.norm(np.diff(path(np.array(times)), axis=0), axis=1).max() <= 0.0015 + 1e-12
