"""Points are located once in a mesh, for all solutions and checkpoints on it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from skfem import ElementTetP2, MeshTet, MeshTet2

from reference_fem import Evaluator, nodes
from reference_fem.elements.shapes import basis_table, element_nodes
from studies.geometry import HalfSpace
from studies.meshing.opened_mesh import opened_elements
from studies.reference.solution import Solution
from studies.scene.cut import Cut
from tests.studies.made_up_run import POINTS, SCENE, bend
from tests.studies.report.view.made import reference_record
from tests.studies.tiny import cube


@pytest.fixture
def located(monkeypatch):
    """The number of points of each search."""
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


@pytest.fixture(scope="module")
def bulged():
    """A solution on a cube of elements with strongly curved edges, and 400 points in and around it."""
    points, _, cells = cube(4)
    mesh = MeshTet2.from_mesh(MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T)))
    corners = mesh.nvertices
    x, random = nodes(mesh), np.random.default_rng(3)
    edge = 1.0 / 4.0 * np.ptp(x[:, 0])
    x[corners:] += random.uniform(-0.08, 0.08, x[corners:].shape) * edge
    values = {"nodes": x, "tetrahedra": element_nodes(mesh), "displacement": bend(x)[None]}
    record = SimpleNamespace(fields={name: SimpleNamespace(values=value) for name, value in values.items()})
    low, high = x.min(axis=0), x.max(axis=0)
    return Solution(SCENE, record), low + (high - low) * random.uniform(0.01, 0.99, (400, 3))


def places(solution, element, local):
    mesh = solution.mesh
    values, _ = basis_table(ElementTetP2(), local.T)
    return np.einsum("ma,mai->mi", values, nodes(mesh)[element_nodes(mesh)[element]])


def test_the_search_that_leaves_elements_out_finds_what_the_search_of_all_finds(bulged, monkeypatch):
    solution, points = bulged
    inverted, invert = [], Evaluator.invert
    monkeypatch.setattr(Evaluator, "invert", lambda *a: inverted.append(len(a[2])) or invert(*a))
    every = Evaluator(solution.mesh)
    element, local = every.locate(points)
    tried_by_all = sum(inverted)
    inverted.clear()
    quick = solution._evaluators[0]
    elements, locals_ = quick.locate(points)
    assert sum(inverted) < tried_by_all / 5
    right = np.linalg.norm(places(solution, element, local) - points, axis=1) < 1e-9
    assert right.sum() > 390 and 10 < (every.outside > 0).sum() < 380
    np.testing.assert_array_equal(elements[right], element[right])
    np.testing.assert_allclose(locals_[right], local[right], atol=1e-8)
    np.testing.assert_allclose(quick.outside[right], every.outside[right], atol=1e-12)


def test_an_inverse_map_that_did_not_converge_is_not_believed(bulged, monkeypatch):
    """One that always ends beyond the face across from the first corner: a place is then the nearest middle of one."""
    solution, points = bulged
    points = points[:50]  # not those that are stored
    monkeypatch.setattr(Evaluator, "invert", lambda self, element, _: np.ones((len(element), 3)))
    monkeypatch.setattr(solution._evaluators[0], "max_outside", np.inf)
    element, local = solution._evaluators[0].locate(points)
    count = len(solution.field("tetrahedra"))
    middles = places(solution, np.arange(count), np.full((count, 3), 1.0 / 3.0))
    nearest = np.linalg.norm(middles[:, None] - points, axis=2).min(axis=0)
    np.testing.assert_allclose(np.linalg.norm(places(solution, element, local) - points, axis=1), nearest, rtol=1e-9)


@pytest.mark.parametrize("lean", [0.0, 1.0, -3.0])
def test_a_place_on_a_cut_is_located_on_either_side_also_where_the_surface_leans_over_its_mouth(lean):
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
