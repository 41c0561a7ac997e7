"""References of scans: sides curved onto one true shape, which all meshes share and which has the file's volume."""

import math
from dataclasses import replace

import numpy as np
import pytest

from reference_fem import facet_nodes, nodes
from studies.geometry.mesh.quality import curved_volume
from studies.geometry.shape.levelset import project
from studies.meshing.graded_mesh import mesh_at
from studies.meshing.reference_mesh import reference_mesh
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.true_shape import true_shape
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solution import Solution
from studies.reference.solve import element_size, solve
from studies.scene.library.ball_clamped import BALL_CLAMPED, CAP, RADIUS
from studies.scene.scene import Organ, ReferencePlan
from studies.store.record import read_record
from tests.studies.geometry.boxes import box, split
from tests.studies.tiny import write_obj

LEVEL = 100
VOLUME = 4 / 3 * math.pi * RADIUS**3


def ball_surface(times):
    """12 · 4^times triangles round a ball, as large as it."""
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=times)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    a, b, c = points[faces].transpose(1, 0, 2)
    inside = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    return points * (VOLUME / inside) ** (1 / 3), faces


@pytest.fixture(scope="module")
def scene(tmp_path_factory, mesh_cache):
    """The clamped ball, its surface read from a file of 3,072 triangles."""
    path = write_obj(tmp_path_factory.mktemp("scan") / "ball.obj", *ball_surface(4))
    organ = Organ("file", {"path": str(path), "unit": "m", "remesh": True})
    plan = ReferencePlan(base=LEVEL, at_contact=0, most=5e3, variants=())
    return replace(BALL_CLAMPED, name="ball_in_a_file", organ=organ, reference=plan)


@pytest.fixture(scope="module")
def shape(scene):
    return true_shape(scene.organ)


@pytest.mark.campaign
def test_the_curved_body_has_the_volume_of_the_surface(scene):
    """A polyhedron with 100 nodes on the ball would be 6 % smaller."""
    mesh = mesh_at(scene, LEVEL, 0, 0, True)
    assert mesh.volume == pytest.approx(VOLUME, rel=1e-3)
    assert curved_volume(mesh.points, mesh.cells) == mesh.volume
    flat = mesh_for(scene, LEVEL, on_shape=True)
    assert flat.volume < 0.97 * VOLUME


@pytest.mark.campaign
def test_a_graded_quadratic_body_is_on_the_same_shape(scene, shape):
    """Halved elements too: their nodes and mid-side nodes lie on the shape, those of outlines on the outline."""
    mesh = mesh_at(scene, LEVEL, 1, 0, True)
    assert np.abs(shape.level(mesh.points[: mesh.outer_count])).max() < 1e-3 * RADIUS
    assert mesh.volume == pytest.approx(VOLUME, rel=2e-3) and mesh.smallest_jacobian > 0
    rim = np.abs(np.abs(mesh.points[mesh.patches["top"], 2]) - CAP * RADIUS) < 1e-9
    assert rim.sum() >= 12


def test_sides_follow_the_true_shape_and_outlines_the_true_outline(scene, shape):
    mesh, patches, _ = reference_mesh(scene, LEVEL)
    points = nodes(mesh)
    distance = np.linalg.norm(points, axis=1)
    outer = np.unique(facet_nodes(mesh))
    # Facets of 3,072 triangles have a sag of 0.2 % where they are longest.
    np.testing.assert_allclose(distance[outer], RADIUS, rtol=3e-3)
    assert np.abs(shape.level(points[outer])).max() < 1e-9 * RADIUS
    for patch in patches:
        assert (np.abs(points[patch, 2]) >= CAP * RADIUS * (1 - 1e-9)).all()


@pytest.mark.campaign
def test_all_meshes_have_one_shape(scene, shape, mesh_cache):
    """Nodes of one are on the shape of the other; the grid of the shape is stored once."""
    for level in (LEVEL, 150):
        mesh = mesh_for(scene, level, on_shape=True)
        on = mesh.points[: mesh.surface_count]
        assert np.abs(project(shape, on) - on).max() < 1e-9 * RADIUS
        assert abs(mesh.surface_count / level - 1) < 0.05
    assert len(list(mesh_cache.glob("ball-*.npz"))) >= 3


def test_the_size_is_that_of_the_mesh_that_is_curved(scene):
    mesh = mesh_for(scene, LEVEL, on_shape=True, even=True)
    edges = mesh.tetrahedra[:, [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]].reshape(-1, 2)
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    lengths = np.linalg.norm(mesh.points[edges[:, 0]] - mesh.points[edges[:, 1]], axis=1)
    assert element_size(scene, LEVEL) == pytest.approx(lengths.mean(), rel=1e-6)


@pytest.mark.slow
def test_a_ball_in_a_file_has_the_reference_of_the_ball(scene, tmp_path):
    """Straight sides, which hold it up to a polygon of another volume, are 4 % off."""
    built_in = replace(scene, organ=BALL_CLAMPED.organ, name="ball_by_name")
    forces = []
    for one in (scene, built_in):
        record = read_record(solve(tmp_path, ReferenceSolve(one)))
        forces.append(Solution(one, record).force[-1])
    assert forces[0] == pytest.approx(forces[1], rel=0.02)
