"""A scene held where its file is painted: the same place in both solvers."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import ImplicitVolume
from reference_fem import nodes
from studies.geometry import painted
from studies.meshing.reference_mesh import reference_mesh
from studies.meshing.scene_mesh import mesh_for, patch_nodes
from studies.runs.case import Case, case_from_json
from studies.runs.recipes import TetrahedralBody
from studies.scene.library.ball_clamped import BALL_CLAMPED, CAP, RADIUS
from studies.scene.scene import Held, Organ
from tests.studies.geometry.boxes import box, split
from tests.studies.geometry.files import writers

LEVEL = 150


@pytest.fixture(scope="module")
def scene(tmp_path_factory, mesh_cache):
    """The clamped ball from a file of 6,146 nodes on which its two caps are painted."""
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=5)
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]  # no row of nodes runs along a border
    points = RADIUS * points / np.linalg.norm(points, axis=1, keepdims=True) @ turn
    caps = {"patch_top": points[:, 2] > CAP * RADIUS, "patch_bottom": points[:, 2] < -CAP * RADIUS}
    path = tmp_path_factory.mktemp("painted") / "ball.vtp"
    path.write_bytes(writers.vtp(points, faces, "packed", caps))
    organ = Organ("file", {"path": str(path), "unit": "m", "remesh": True})
    held = tuple(replace(one, region=painted(path, one.name, "m")) for one in BALL_CLAMPED.held)
    return replace(BALL_CLAMPED, name="painted_ball", organ=organ, held=held)


def heights(points, patch):
    """Over that of the painted border: 1 on it, more within the cap."""
    return np.abs(points[patch, 2]) / (CAP * RADIUS)


@pytest.mark.campaign
def test_both_solvers_hold_what_is_painted(scene):
    mesh = mesh_for(scene, LEVEL)
    fine, held, _ = reference_mesh(scene, LEVEL)
    cap = 2 * np.pi * RADIUS**2 * (1 - CAP)
    for number, one in enumerate(scene.held):
        patch = patch_nodes(mesh, one.name, one.region)
        for ratio in (heights(mesh.points, patch), heights(nodes(fine), held[number])):
            # A third of an edge of the file is 2 % of the height; an edge of the mesh reaches to the top of the cap.
            assert 0.98 < ratio.min() < 1.02 and (ratio < 1.02).sum() >= 9
        assert mesh.points[patch, 2].sum() * (1 if one.name == "top" else -1) > 0
        corners = mesh.points[mesh.patch_triangles(one.name)]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
        assert area == pytest.approx(cap, rel=0.08)  # flat facets of a cap are 4 % smaller on so few nodes


def test_the_scene_is_kept_whole_in_its_key(scene):
    case = Case(scene, TetrahedralBody(nodes=LEVEL), ImplicitVolume())
    assert case_from_json(case.key) == case
    assert len(case.key) < 100_000


def test_on_the_triangles_of_the_file_the_painted_nodes_are_held(scene):
    plain = replace(scene, organ=Organ("file", {**scene.organ.parameters, "remesh": False}))
    mesh = mesh_for(plain, 0, filled=False)
    top = patch_nodes(mesh, "top", Held("top", scene.held[0].region).region)
    assert set(top) == set(np.flatnonzero(mesh.points[:, 2] > CAP * RADIUS))
