"""Points are found once in a mesh, whichever solution on it and whichever checkpoint is asked."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from skfem import MeshTet, MeshTet2

from reference_fem import Evaluator, nodes
from reference_fem.elements.shapes import element_nodes
from studies.geometry import HalfSpace
from studies.meshing.opened_mesh import opened_elements
from studies.reference.solution import Solution
from studies.scene.cut import Cut
from tests.studies.made_up_run import POINTS, SCENE, bend
from tests.studies.report.view.made import reference_record
from tests.studies.tiny import cube


@pytest.fixture
def located(monkeypatch):
    """How many points each search was for."""
    searched, locate = [], Evaluator.locate
    monkeypatch.setattr(Evaluator, "locate", lambda self, points: searched.append(len(points)) or locate(self, points))
    return searched


def test_solutions_on_one_mesh_find_the_same_points_once(located):
    one, other = (Solution(SCENE, reference_record(SCENE)) for _ in range(2))
    inside = 0.5 * (POINTS[:-1] + POINTS[1:])
    for solution in (one, other):
        np.testing.assert_allclose(solution.displacement(inside), bend(inside), atol=1e-15)
        np.testing.assert_allclose(solution.displacement(inside, 0), bend(inside) / len(SCENE.checkpoints), atol=1e-15)
        np.testing.assert_array_equal(solution.displacements(inside)[-1], solution.displacement(inside))
    assert located == [len(inside)]
    one.displacement(POINTS)
    assert located == [len(inside), len(POINTS)]


def test_meshes_that_differ_by_a_node_are_searched_each(located):
    record = reference_record(SCENE)
    one = Solution(SCENE, record)
    one.displacement(POINTS)
    nodes = record.fields["nodes"].values
    nodes[0] += 1e-9
    Solution(SCENE, record).displacement(POINTS)
    assert located == [len(POINTS)] * 2


@pytest.mark.parametrize("lean", [0.0, 1.0, -3.0])
def test_a_place_on_a_cut_is_found_on_either_side_also_where_the_surface_leans_over_its_mouth(lean):
    """A cube that leans along x is cut in two, and its upper half moves up by 10 mm: so wide is the cut everywhere."""
    points, _, cells = cube(3)
    points = (points + np.array([0.0, 0.0, 0.1 / 6])) * [1.0, 1.3, 1.0]
    points[:, 0] += lean * points[:, 2]
    plain = MeshTet2.from_mesh(MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T)))
    faces = plain.facets.T[(np.abs(plain.p[2][plain.facets]) < 1e-12).all(axis=0)]
    mesh, _ = opened_elements(plain, faces[np.argsort(faces[:, 0])])
    x = nodes(mesh)
    moved = np.zeros_like(x)
    moved[np.unique(element_nodes(mesh)[x[mesh.t[:4].T].mean(axis=1)[:, 2] > 0]), 2] = 0.01
    values = {"nodes": x, "tetrahedra": mesh.t[:4].T, "displacement": moved[None]}
    record = SimpleNamespace(fields={name: SimpleNamespace(values=value) for name, value in values.items()})
    scene = replace(SCENE, cuts=(Cut("section", HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), at=1.0),))
    mouth = np.unique(faces)
    assert len(mouth) == 16 and len(x) > len(nodes(plain))
    np.testing.assert_allclose(Solution(scene, record).opening(points[mouth]), [[0.0, 0.0, 0.01]] * 16, atol=1e-12)
