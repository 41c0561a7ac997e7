"""The mesh of a reference: held up to the true outline, finer where asked, never folded."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import ElementTetP2, MeshTet, MeshTet2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet
from studies.meshing.reference_outlines import LEAST, SHARE, drawn_to_outlines
from studies.reference.size import element_size, outline_size

from reference_fem import NewtonSettings, facet_nodes, nodes
from reference_fem.elements.shapes import basis_table, element_nodes
from reference_fem.model.problem import find_held
from reference_fem.system.saddle_point import System
from studies.base.errors import StudyError
from studies.geometry.mesh.jacobian import smallest_jacobian
from studies.meshing.held_mesh import rim_sides, with_patches
from studies.meshing.reference_mesh import reference_mesh
from studies.reference.problem import reference_problem
from studies.scene.library.ball_clamped import BALL_CLAMPED, CAP, RADIUS
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.library.liver_probe import LIVER_PROBE
from tests.studies.tiny import cube

LEVEL, LIVER_LEVEL = 150, 200


def planned(scene, **changes):
    return replace(scene, reference=replace(scene.reference, **changes))


def areas(mesh, chosen):
    """Area of the plane projection of the six-node facets whose nodes are all chosen, seen along z [m²]."""
    table = facet_nodes(mesh)
    table = table[np.isin(table, chosen).all(axis=1)]
    x = nodes(mesh)[table]
    # Four flat triangles to a facet: what they cut off is a quarter of a quarter.
    parts = [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]
    a, b, c = (np.concatenate([x[:, p[k]] for p in parts]) for k in range(3))
    return abs(np.cross(b - a, c - a)[:, 2].sum()) / 2


@pytest.mark.parametrize("times", [0, 3])
def test_caps_are_round(mesh_cache, times):
    """A cap |z| > 0.8 R is a disc of radius 0.6 R seen along z; a polygon of a dozen sides would be 4 % smaller."""
    mesh, patches, _ = reference_mesh(planned(BALL_CLAMPED, at_outlines=times), LEVEL)
    for patch in patches:
        x = nodes(mesh)[patch]
        # New nodes lie on the quadratic sides of a dozen elements around: a thousandth of the radius off the sphere.
        assert (np.abs(x[:, 2]) >= CAP * RADIUS * (1 - 2e-3)).all()
        np.testing.assert_allclose(np.linalg.norm(x, axis=1), RADIUS, rtol=2e-3 if times else 1e-9)
        # Two chords to a side of a dozen: 1 - sin(2π/24)/(2π/24).
        assert areas(mesh, patch) == pytest.approx(np.pi * (0.6 * RADIUS) ** 2, rel=0.012)


def test_outline_is_closed_and_on_the_edge_of_the_region(mesh_cache):
    mesh, patches, _ = reference_mesh(planned(BALL_CLAMPED, at_outlines=0), LEVEL)
    table = facet_nodes(mesh)
    sides = rim_sides(table[np.isin(table[:, :3], patches[0]).all(axis=1)])
    _, count = np.unique(sides[:, :2], return_counts=True)
    assert (count == 2).all()
    np.testing.assert_allclose(nodes(mesh)[sides][..., 2], -CAP * RADIUS, rtol=1e-9)


@pytest.mark.parametrize(
    ("scene", "level", "changes"),
    [(BALL_CLAMPED, LEVEL, {"at_outlines": 3}), (LIVER_PROBE, LIVER_LEVEL, {"at_contact": 5})],
)
def test_finer_meshes_are_upright_and_still_held(mesh_cache, scene, level, changes):
    """Moving each new node onto the surface by itself folds elements of the ball; the solver refuses such a mesh."""
    even = {"at_outlines": 0, "at_contact": 0}
    coarse, fine = (reference_problem(planned(scene, **even | c), level) for c in ({}, changes))
    System(fine, NewtonSettings()).solver.release()
    assert fine.mesh.nelements > 1.2 * coarse.mesh.nelements
    for before, after in zip(find_held(coarse), find_held(fine), strict=True):
        assert len(after.nodes) >= len(before.nodes)


def test_refinement_is_where_the_probe_will_be(mesh_cache):
    sphere = LIVER_PROBE.obstacles[0]
    deepest = np.asarray(sphere.centre) + sphere.path(LIVER_PROBE.checkpoints[-1])

    def near(changes):
        x = nodes(reference_mesh(planned(LIVER_PROBE, at_outlines=0, **changes), LIVER_LEVEL)[0])
        away = np.linalg.norm(x - deepest, axis=1)
        return (away < sphere.radius).sum(), (away > 2.5 * sphere.radius).sum()

    (inside, outside), (more_inside, more_outside) = near({"at_contact": 0}), near({"at_contact": 3})
    assert more_inside > 3 * inside
    assert more_outside < 1.3 * outside


def test_a_body_from_a_file_keeps_its_own_outline():
    """No true surface is known: a patch is the polygon of its facets, on the finer mesh as well."""
    points, _, cells = cube(2)
    body = with_patches(MeshTet(points.T.copy(), cells.T.copy()), [np.flatnonzero(points[:, 2] < -0.049)])
    finer = body.bisected(body.at_outlines()).bisected(np.arange(5))
    mesh = MeshTet2.from_mesh(finer.mesh)
    (facets,) = finer.facets(mesh)
    assert (nodes(mesh)[facets][..., 2] == -0.05).all()
    assert areas(mesh, np.unique(facets)) == pytest.approx(0.1**2, rel=1e-12)
    assert len(facets) > 8


def edge_of_a_cube():
    """A straight second-order mesh, and its vertices on the line x = y = 0 of one of its faces."""
    points, _, cells = cube(3)
    points = points - points.min(axis=0)
    mesh = MeshTet2.from_mesh(MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T)))
    return mesh, np.flatnonzero(np.hypot(points[:, 0], points[:, 1]) < 1e-9)


def test_drawn_elements_hold_the_root_of_the_distance_better():
    """√r, interpolated at the nodes, at the quadrature points of the elements beside the outline r = 0."""
    mesh, outline = edge_of_a_cube()
    drawn = drawn_to_outlines(mesh, outline)
    beside = np.isin(mesh.t, outline).any(axis=0)
    shape, _ = basis_table(ElementTetP2(), get_quadrature(RefTet, 6)[0])

    def left(mesh):
        x = nodes(mesh)[element_nodes(mesh)[beside]]
        at = np.einsum("eni,qn->eqi", x, shape)
        wanted, held = (np.sqrt(np.hypot(y[..., 0], y[..., 1])) for y in (at, x))
        return np.sqrt(((held @ shape.T - wanted) ** 2).mean())

    assert left(drawn) < 0.6 * left(mesh)


def test_only_middles_of_sides_that_leave_the_outline_are_drawn():
    mesh, outline = edge_of_a_cube()
    before, after = nodes(mesh), nodes(drawn_to_outlines(mesh, outline))
    ends = np.asarray(mesh.edges).T
    leaving = np.isin(ends, outline).sum(axis=1) == 1
    moved = np.linalg.norm(after - before, axis=1) > 1e-9
    np.testing.assert_array_equal(moved[: mesh.nvertices], False)
    np.testing.assert_array_equal(moved[mesh.nvertices :], leaving)
    near = np.where(np.isin(ends[:, 0], outline), ends[:, 0], ends[:, 1])[leaving]
    way = np.linalg.norm(after[mesh.nvertices :][leaving] - before[near], axis=1)
    np.testing.assert_allclose(way, SHARE * np.linalg.norm(np.diff(before[ends[leaving]], axis=1)[:, 0], axis=1))


def test_what_would_fold_is_left_as_it_was(mesh_cache):
    """At the cap of a coarse ball the sides of some elements are too curved; all others are drawn."""
    scene = planned(BALL_CLAMPED, at_outlines=1)
    mesh, _, _ = reference_mesh(scene, LEVEL)
    lowest = smallest_jacobian(nodes(mesh), element_nodes(mesh))
    assert lowest.min() >= LEAST
    assert lowest.min() < 0.1


def test_each_mesh_of_a_plan_is_halved_as_often_as_it_says(mesh_cache):
    scene = planned(BALL_CLAMPED, levels=(100, LEVEL), at_outlines=(0, 2))
    for level, times in ((100, 0), (LEVEL, 2)):
        wanted = reference_mesh(planned(BALL_CLAMPED, levels=(level, level), at_outlines=times), level)[0]
        np.testing.assert_array_equal(nodes(reference_mesh(scene, level)[0]), nodes(wanted))
    with pytest.raises(StudyError, match="none of the plan's"):
        reference_mesh(scene, 120)


def test_the_size_of_a_mesh_is_told_before_it_is_halved(mesh_cache):
    """A quarter of the nodes: edges twice as long, within what the rim of a ball takes up; halving changes nothing."""
    fine, coarse = (element_size(planned(BALL_CLAMPED, at_outlines=3), level) for level in (400, 100))
    assert coarse / fine == pytest.approx(2.0, rel=0.15)
    assert element_size(planned(BALL_CLAMPED, at_outlines=0), 400) == fine
    assert element_size(BALL_SQUEEZE, 0.16) == pytest.approx(0.16 * 0.05)


def rim_of(times):
    problem = reference_problem(planned(BALL_CLAMPED, at_outlines=times), 100)
    return outline_size(problem.mesh, find_held(problem))


def test_elements_at_outlines_shrink_by_more_than_their_volume_is_halved(mesh_cache):
    """Two halvings take half of each side there, not three: neighbours that must be halved too lie there as well."""
    sizes = [rim_of(times) for times in range(5)]
    shrink = (sizes[4] / sizes[0]) ** (1 / 4)
    assert shrink == pytest.approx(2 ** (-1 / 2), rel=0.04)
    assert shrink < 2 ** (-1 / 3) * 0.95
    assert sizes[0] == pytest.approx(element_size(BALL_CLAMPED, 100), rel=0.2)


def test_a_body_that_is_held_nowhere_has_no_elements_at_outlines():
    mesh, _ = edge_of_a_cube()
    assert np.isnan(outline_size(mesh, []))
