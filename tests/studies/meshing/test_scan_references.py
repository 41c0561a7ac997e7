"""References of scans: sides curved onto one true shape, which all meshes share and which has the file's volume."""

import math
from dataclasses import replace

import numpy as np
import pytest

from reference_fem import facet_nodes, nodes
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
