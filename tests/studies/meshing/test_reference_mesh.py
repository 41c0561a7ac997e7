"""The mesh of a reference: held up to the true outline, finer where it will be touched, never folded."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import ElementTetP2, MeshTet, MeshTet2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from reference_fem import facet_nodes, nodes
from reference_fem.elements.shapes import basis_table, element_nodes
from studies.meshing.held_mesh import rim_sides, with_patches
from studies.meshing.nested_mesh import SHARE
from studies.meshing.reference_mesh import reference_mesh
from studies.meshing.shaping import drawn_middles
from studies.reference.solve import element_size
from studies.scene.library.ball_clamped import BALL_CLAMPED, CAP, RADIUS
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from tests.studies.tiny import cube

LEVEL, LIVER_LEVEL = 150, 200


def areas(mesh, chosen):
    """Area of the plane projection of the six-node facets whose nodes are all chosen, seen along z [m²]."""
    table = facet_nodes(mesh)
    table = table[np.isin(table, chosen).all(axis=1)]
    x = nodes(mesh)[table]
    # Four flat triangles to a facet: what they cut off is a quarter of a quarter.
    parts = [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]
    a, b, c = (np.concatenate([x[:, p[k]] for p in parts]) for k in range(3))
    return abs(np.cross(b - a, c - a)[:, 2].sum()) / 2


def test_caps_are_round(mesh_cache):
    """A cap |z| > 0.8 R is a disc of radius 0.6 R seen along z; a polygon of a dozen sides would be 4 % smaller."""
    mesh, patches, _ = reference_mesh(BALL_CLAMPED, LEVEL)
    for patch in patches:
        x = nodes(mesh)[patch]
        assert (np.abs(x[:, 2]) >= CAP * RADIUS * (1 - 1e-9)).all()
        np.testing.assert_allclose(np.linalg.norm(x, axis=1), RADIUS, rtol=1e-9)
        # Two chords to a side of a dozen: 1 - sin(2π/24)/(2π/24).
        assert areas(mesh, patch) == pytest.approx(np.pi * (0.6 * RADIUS) ** 2, rel=0.012)


def test_outline_is_closed_and_on_the_edge_of_the_region(mesh_cache):
    mesh, patches, _ = reference_mesh(BALL_CLAMPED, LEVEL)
    table = facet_nodes(mesh)
    sides = rim_sides(table[np.isin(table[:, :3], patches[0]).all(axis=1)])
    _, count = np.unique(sides[:, :2], return_counts=True)
    assert (count == 2).all()
    np.testing.assert_allclose(nodes(mesh)[sides][..., 2], -CAP * RADIUS, rtol=1e-9)


def test_a_body_from_a_file_keeps_its_own_outline():
    """It has no true surface: a patch is the polygon of its facets, on the finer mesh as well."""
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


def drawn(mesh, outline):
    """The mesh with its middles where a nested mesh has them."""
    points = drawn_middles(nodes(mesh), mesh, outline, SHARE)
    return replace(mesh, doflocs=np.ascontiguousarray(points.T))


def test_drawn_elements_hold_the_root_of_the_distance_better():
    """√r, interpolated at the nodes, at the quadrature points of the elements that touch the outline r = 0."""
    mesh, outline = edge_of_a_cube()
    closer = drawn(mesh, outline)
    touching = np.isin(mesh.t, outline).any(axis=0)
    shape, _ = basis_table(ElementTetP2(), get_quadrature(RefTet, 6)[0])

    def left(mesh):
        x = nodes(mesh)[element_nodes(mesh)[touching]]
        at = np.einsum("eni,qn->eqi", x, shape)
        exact, nodal = (np.sqrt(np.hypot(y[..., 0], y[..., 1])) for y in (at, x))
        return np.sqrt(((nodal @ shape.T - exact) ** 2).mean())

    assert left(closer) < 0.8 * left(mesh)


def test_only_middles_of_sides_that_leave_the_outline_are_drawn():
    mesh, outline = edge_of_a_cube()
    before, after = nodes(mesh), nodes(drawn(mesh, outline))
    ends = np.asarray(mesh.edges).T
    leaving = np.isin(ends, outline).sum(axis=1) == 1
    moved = np.linalg.norm(after - before, axis=1) > 1e-9
    np.testing.assert_array_equal(moved[: mesh.nvertices], False)
    np.testing.assert_array_equal(moved[mesh.nvertices :], leaving)
    near = np.where(np.isin(ends[:, 0], outline), ends[:, 0], ends[:, 1])[leaving]
    way = np.linalg.norm(after[mesh.nvertices :][leaving] - before[near], axis=1)
    np.testing.assert_allclose(way, SHARE * np.linalg.norm(np.diff(before[ends[leaving]], axis=1)[:, 0], axis=1))


def test_the_size_of_a_mesh_is_the_mean_of_its_edges(mesh_cache):
    """A quarter of the nodes: edges twice as long, within what the rim of a ball takes up."""
    fine, coarse = (element_size(BALL_CLAMPED, level) for level in (400, 100))
    assert coarse / fine == pytest.approx(2.0, rel=0.15)
    assert element_size(BALL_SQUEEZE, 0.16) == pytest.approx(0.16 * 0.05)
