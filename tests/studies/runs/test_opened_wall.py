"""A hollow ball whose wall is cut through: its content goes, and it ends as one that was never filled."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import ImplicitVolume, Ramp, simulate
from studies.geometry import organ
from studies.geometry.mesh.organ_mesh import boundary_triangles, tetrahedron_volumes, triangle_areas, unique_edges
from studies.meshing.opened_mesh import opened_mesh
from studies.meshing.scene_mesh import mesh_for
from studies.runs.case import Case
from studies.runs.prepare import mesh_of, prepared_on
from studies.runs.recipes import QuadraticBody, TetrahedralBody
from studies.scene.library import SHELL_OPENED
from studies.scene.library.ball_cuts import RADIUS, WALL
from studies.scene.scene import Lumen
from tests.campaigns import campaigns_but

NODES = 250
BODIES = {
    "wall": TetrahedralBody(nodes=NODES),
    "nodal": TetrahedralBody(nodes=NODES, law="cotangent", volumes="nodal"),
    "quadratic": QuadraticBody(nodes=354, mass="stiffness"),
}
OPEN, FULL = Lumen("open"), Lumen(filling=Ramp((0.0, 0.7), (1.0, 1.15)))


@pytest.fixture(scope="module")
def mesh():
    return mesh_for(SHELL_OPENED, NODES, even=True)


def with_cut(**changes):
    return replace(SHELL_OPENED, cuts=(replace(SHELL_OPENED.cut, **changes),))


def run(scene, kind, mesh):
    case = Case(scene, BODIES[kind], ImplicitVolume(tolerance=1e-10, most_iterations=500), dt_fraction=0.8)
    made = prepared_on(case, mesh)
    history = simulate(made.setup)
    assert history.outcome == "finished", history.message
    return made, history


def euler(triangles: np.ndarray) -> int:
    return len(np.unique(triangles)) - len(unique_edges(triangles)) + len(triangles)


@pytest.mark.parametrize("layers", [1, 3])
def test_the_faces_of_the_cut_are_half_a_ring_through_the_wall(layers):
    made = organ("ball", NODES, {}, parameters=SHELL_OPENED.organ.parameters, layers=layers, cuts=SHELL_OPENED.cuts)
    faces = made.cuts["opening"]
    assert np.abs(made.points[faces][:, :, 2]).max() < 1e-12
    ring = 0.5 * np.pi * (RADIUS**2 - (RADIUS - WALL) ** 2)
    assert triangle_areas(made.points, faces).sum() == pytest.approx(ring, rel=0.03)
    a, b, c = made.points[faces].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()  # seen from in front
    distance = np.linalg.norm(made.points, axis=1)
    depths = np.unique(np.round((RADIUS - distance) / WALL * layers, 6))
    np.testing.assert_allclose(depths, np.arange(layers + 1))
    after = opened_mesh(made).mesh
    assert (euler(boundary_triangles(made.tetrahedra)), euler(boundary_triangles(after.tetrahedra))) == (4, 2)
    assert not after.hollow and tetrahedron_volumes(made.points, made.tetrahedra).min() > 0
    assert after.volume == pytest.approx(made.volume, rel=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("kind", campaigns_but(BODIES, lambda kind: kind != "quadratic"))
def test_opened_it_ends_as_one_that_was_never_filled(kind, mesh):
    mesh = mesh_of(SHELL_OPENED, BODIES[kind]) if kind == "quadratic" else mesh
    filled, history = run(replace(SHELL_OPENED, lumen=FULL), kind, mesh)
    _, other = run(replace(SHELL_OPENED, lumen=OPEN), kind, mesh)
    before, last = history.held_force[:, 1, 2], other.held_force[:, 1, 2]
    assert abs(before[49] / last[49] - 1) > 0.1  # the content pushes at the caps
    np.testing.assert_allclose(history.final, other.final, atol=1e-6 * filled.body.size)
    assert before[-1] == pytest.approx(last[-1], rel=1e-4)
    assert filled.setup.body.kept.count == filled.setup.events[0].ended[0] + 1
    assert opened_mesh(mesh).mesh.hollow is False
    assert "lumen" in filled.setup.body.kept.names and "lumen" not in filled.body.kept.names
    np.testing.assert_allclose(history.volume[-1], filled.body.rest_volumes, rtol=1e-6)
    behind, front = filled.opening.pairs.T
    assert (history.final[front] - history.final[behind])[:, 2].max() > 0.01
    assert max(passage.energy for passage in history.passages) < 1e-11


@pytest.mark.slow
def test_a_wall_that_is_opened_by_and_by_ends_where_one_opened_at_once_does(mesh):
    made, history = run(with_cut(until=1.6, along=(0.0, 1.0, 0.0)), "wall", mesh)
    _, once = run(SHELL_OPENED, "wall", mesh)
    ended = [event.ended for event in made.setup.events]
    assert len(ended) > 5 and ended[0] == (1,) and set(ended[1:]) == {()}
    np.testing.assert_allclose(history.final, once.final, atol=1e-6 * made.body.size)


@pytest.mark.slow
def test_both_halves_of_a_wall_keep_their_volumes():
    scene = with_cut(within=None)
    made, history = run(scene, "wall", mesh_for(scene, NODES, even=True))
    assert made.body.kept.count == 2
    np.testing.assert_allclose(history.volume[-1], made.body.rest_volumes, rtol=1e-6)
    np.testing.assert_allclose(history.volume.sum(axis=1), made.body.rest_volumes.sum(), rtol=1e-4)
