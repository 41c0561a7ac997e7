"""Nested meshes: parts of their parents, on the true shape, held alike, finer where the indicator is large."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from skfem import MeshTet, MeshTet2

from massspring.body.quadratic import PARTS_OF_FACET
from reference_fem import NewtonSettings, facet_nodes, nodes
from reference_fem.elements.shapes import build_elements, check_neighbours, element_nodes
from reference_fem.system.saddle_point import System
from studies.geometry import HalfSpace
from studies.geometry.mesh.organ_mesh import tetrahedron_volumes, triangle_normals
from studies.geometry.mesh.quality import smallest_jacobian
from studies.lab.population.draw import member
from studies.meshing.bounds import REFERENCE_SHAPE
from studies.meshing.held_mesh import held_mesh, with_patches
from studies.meshing.kept_shape import area_error
from studies.meshing.nested_mesh import LEAST, LOST, SHARE, NestedMesh, base_mesh, marked, upright
from studies.meshing.rest_surface import rest_surfaces
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.true_surface import shape_errors
from studies.reference.nested import problem_of
from studies.scene.cut import Cut
from studies.scene.library import BALL_CLAMPED, SPLEEN_SAG
from studies.scene.library.ball_clamped import CAP, RADIUS
from tests.studies.tiny import cube, file_scene, write_obj

BASE = 80
"""Surface nodes of the ball's coarsest mesh."""
CORNERS = np.vstack([np.zeros(3), np.eye(3)])
MESHES = 3


def volumes(mesh):
    """Of the straight elements [m³], (ne,)."""
    return tetrahedron_volumes(mesh.p.T, mesh.t.T)


def barycentric(mesh, elements, points):
    """Four coordinates of each point in its straight element, (n, 4)."""
    corners = mesh.p.T[mesh.t.T[elements]]
    edges = (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
    local = np.linalg.solve(edges, (points - corners[:, 0])[:, :, None])[:, :, 0]
    return np.column_stack([1 - local.sum(axis=1), local])


def check_parents(coarse, fine, parents):
    """Each part lies in its parent, and the parts of each fill it."""
    middles = fine.p.T[fine.t.T].mean(axis=1)
    assert barycentric(coarse, parents, middles).min() > 1e-3
    filled = np.bincount(parents, np.abs(volumes(fine)), coarse.nelements)
    np.testing.assert_allclose(filled, np.abs(volumes(coarse)), rtol=1e-12)


def box_mesh(cells=2):
    """A cube that is held below."""
    points, _, tetrahedra = cube(cells)
    mesh = MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(tetrahedra.T))
    return with_patches(mesh, [np.flatnonzero(points[:, 2] < -0.049)])


@pytest.mark.parametrize("seed", [0, 1])
def test_halved_elements_know_their_parents(seed):
    """After one round and after four: neighbours are halved as well, some of them more than once in a round."""
    body = first = box_mesh()
    ancestors, noise = np.arange(body.mesh.nelements), np.random.default_rng(seed)
    for _ in range(4):
        chosen = noise.choice(body.mesh.nelements, 5, replace=False)
        finer, parents = body.halved(np.sort(chosen))
        check_parents(body.mesh, finer.mesh, parents)
        assert (np.bincount(parents)[chosen] > 1).all(), "all that were chosen are halved"
        np.testing.assert_array_equal(finer.mesh.p[:, : body.mesh.nvertices], body.mesh.p)
        same = body.bisected(np.sort(chosen)).mesh
        np.testing.assert_array_equal(same.t, finer.mesh.t)
        body, ancestors = finer, ancestors[parents]
    check_parents(first.mesh, body.mesh, ancestors)


@pytest.fixture(scope="module")
def base(mesh_cache):
    """The coarsest mesh of the clamped ball."""
    return base_mesh(BALL_CLAMPED, BASE, 0)


def beside_top_outline(mesh):
    """An indicator that is large near the outline of the upper cap, (ne,)."""
    middles = mesh.body.mesh.p.T[mesh.body.mesh.t.T].mean(axis=1)
    ring = np.hypot(np.hypot(middles[:, 0], middles[:, 1]) - 0.6 * RADIUS, middles[:, 2] - CAP * RADIUS)
    return volumes(mesh.body.mesh) ** 2 * (ring / RADIUS + 0.05) ** -3


@pytest.fixture(scope="module")
def family(base):
    """Meshes of 2, 4 and 8 times the elements, and the parents of each."""
    made = [(base, np.arange(0))]
    for _ in range(MESHES):
        latest = made[-1][0]
        made.append(latest.finer(beside_top_outline(latest), 2 * latest.mesh.nelements))
    return made


def test_a_finer_mesh_is_nested_in_the_coarser_one(family):
    """The flat elements are; the coarser ones' vertices come first, and those inside do not move."""
    for (coarse, _), (fine, parents) in pairwise(family):
        check_parents(coarse.body.mesh, fine.body.mesh, parents)
        assert 1.95 < fine.mesh.nelements / coarse.mesh.nelements < 2.25
        count = coarse.mesh.nvertices
        np.testing.assert_array_equal(fine.body.mesh.p[:, :count], coarse.body.mesh.p)
        np.testing.assert_allclose(fine.points[:count], coarse.points[:count], rtol=0, atol=1e-9 * RADIUS)
        np.testing.assert_array_equal(nodes(fine.mesh)[: fine.mesh.nvertices], fine.points[: fine.mesh.nvertices])


def test_the_boundary_is_on_the_true_surface_and_outlines_on_the_true_outline(family):
    """No node was put back."""
    for mesh, _ in family[1:]:
        assert mesh.off == 0
        flat = MeshTet2.from_mesh(mesh.body.mesh)
        outer = np.unique(facet_nodes(flat))
        np.testing.assert_allclose(np.linalg.norm(mesh.points[outer], axis=1), RADIUS, rtol=1e-9)
        for patch in mesh.patches:
            height = np.abs(mesh.points[patch, 2]) / (CAP * RADIUS)
            assert height.min() == pytest.approx(1.0, abs=1e-9)
            assert (np.abs(height - 1) < 1e-9).sum() >= 16


def facet_areas(mesh, chosen):
    """Area along z of the six-node facets whose nodes are all chosen, four flat triangles to each [m²]."""
    table = facet_nodes(mesh)
    flat = table[np.isin(table, chosen).all(axis=1)][:, PARTS_OF_FACET].reshape(-1, 3)
    return abs(triangle_normals(nodes(mesh), flat)[:, 2].sum()) / 2


def test_held_caps_keep_their_area_and_come_closer_to_the_disc(family):
    """|z| > 0.8 R, seen along z: a disc of radius 0.6 R."""
    disc = np.pi * (0.6 * RADIUS) ** 2
    missing = [[1 - facet_areas(mesh.mesh, patch) / disc for patch in mesh.patches] for mesh, _ in family]
    assert max(map(max, missing)) < 0.03 and min(map(min, missing)) > 0
    below, above = np.array(missing).T
    assert (np.diff(above) < 0).all() and above[-1] < 0.2 * above[0]
    assert below[-1] > 0.5 * below[0], "nothing is refined there"
    off = [abs(build_elements(mesh.mesh, 4).weights.sum() / (4 / 3 * np.pi * RADIUS**3) - 1) for mesh, _ in family]
    assert max(off) < 2e-3 and off[-1] < off[0]


def test_elements_are_halved_where_the_indicator_is_large(family):
    """The tenth of the base's elements with the largest indicators has most of the new ones; far ones stay whole."""
    coarse, (fine, parents) = family[0][0], family[1]
    indicator = beside_top_outline(coarse)
    parts = np.bincount(parents, minlength=coarse.mesh.nelements)
    order = np.argsort(-indicator)
    count = len(order)
    assert (parts[order[: count // 10]] > 1).all()
    assert parts[order[: count // 10]].mean() > 2.5 * parts[order[count // 2 :]].mean()
    assert (parts[order[-count // 4 :]] == 1).mean() > 0.6
    assert fine.mesh.nelements == parts.sum()


def test_meshes_are_upright_and_their_middles_are_drawn_to_outlines(family):
    """The solver takes them; sides that leave an outline have their middles nearer to it, all others half-way."""
    for mesh, _ in family:
        assert smallest_jacobian(nodes(mesh.mesh), element_nodes(mesh.mesh)).min() >= LEAST
        System(problem_of(mesh), NewtonSettings()).solver.release()
        flat = MeshTet2.from_mesh(mesh.body.mesh)
        moved = np.linalg.norm(nodes(mesh.mesh) - mesh.points, axis=1) > 1e-9 * RADIUS
        assert moved.any()
        ends = np.asarray(flat.edges).T[moved[flat.nvertices :]]
        height = np.abs(np.abs(mesh.points[ends][..., 2]) - CAP * RADIUS) < 1e-9 * RADIUS
        on_sphere = np.abs(np.linalg.norm(mesh.points[ends], axis=2) - RADIUS) < 1e-9 * RADIUS
        np.testing.assert_array_equal((height & on_sphere).sum(axis=1), 1)
        near = np.where((height & on_sphere)[:, :1], ends[:, :1], ends[:, 1:])[:, 0]
        sides = np.linalg.norm(np.diff(mesh.points[ends], axis=1)[:, 0], axis=1)
        way = np.linalg.norm(nodes(mesh.mesh)[moved] - mesh.points[near], axis=1) / sides
        assert np.median(way) == pytest.approx(SHARE, abs=0.01)


def test_the_last_bits_of_an_indicator_change_no_mark(base):
    """Processors round differently: elements with equal indicators are marked in the order of their numbers."""
    ranks = np.argsort(np.argsort(beside_top_outline(base)))
    indicator = 1.0 + ranks // 40
    noisy = indicator * (1 + 1e-15 * np.random.default_rng(1).integers(-2, 3, len(indicator)))
    (one, _), (other, _) = (marked(base.body, each, 2 * base.mesh.nelements) for each in (indicator, noisy))
    np.testing.assert_array_equal(one.mesh.t, other.mesh.t)
    even, _ = marked(base.body, np.ones(len(indicator)), base.mesh.nelements + 1)
    first, _ = base.body.halved(np.array([0]))
    np.testing.assert_array_equal(even.mesh.t, first.mesh.t)


def test_an_element_that_would_fold_keeps_the_nodes_that_are_safe():
    """Two elements with a common face; a middle of one of them is moved through the other side."""
    corners, elements = np.vstack([CORNERS, np.ones(3)]), np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    mesh = MeshTet2.from_mesh(MeshTet(np.ascontiguousarray(corners.T), np.ascontiguousarray(elements.T)))
    cells, safe = element_nodes(mesh), nodes(mesh)
    moved = safe.copy()
    alone = next(n for n in range(mesh.nvertices, len(safe)) if (cells == n).sum() == 1 and n in cells[0])
    far = next(n for n in range(mesh.nvertices, len(safe)) if (cells == n).sum() == 1 and n in cells[1])
    moved[alone] += 2.0 * (safe[cells[0, :4]].mean(axis=0) - safe[alone])
    moved[far] += 0.01
    x, back = upright(safe, moved, cells, 0.05)
    np.testing.assert_array_equal(np.flatnonzero(back), [alone])
    np.testing.assert_array_equal(x[alone], safe[alone])
    np.testing.assert_array_equal(x[far], moved[far])


def test_a_body_that_comes_as_a_mesh_keeps_its_flat_sides(tmp_path):
    """It has no true surface: nothing is moved."""
    points, triangles, _ = cube(2)
    used = np.unique(triangles)
    path = write_obj(tmp_path / "box.obj", points[used], np.searchsorted(used, triangles))
    body = box_mesh()
    start = NestedMesh(file_scene(path), replace(body, patches=[*body.patches, body.patches[0][:0]]), nodes(body.mesh))
    fine, parents = start.finer(np.arange(1.0, body.mesh.nelements + 1), 3 * body.mesh.nelements)
    check_parents(body.mesh, fine.body.mesh, parents)
    np.testing.assert_allclose(fine.points, nodes(fine.body.mesh), rtol=0, atol=1e-15)
    assert fine.off == 0 and fine.lumen_at(0.0) is None


def test_the_faces_of_a_cut_stay_in_its_plane_where_the_surface_leans_over_it():
    """A ball cut off its middle, where sides that follow the surface alone would leave the plane by 0.3 mm; the faces
    fill the disc of the section, and of its rim every node is on the ball."""
    height = 0.5 * RADIUS
    cut = Cut("lid", HalfSpace((0.0, 0.0, height), (0.0, 0.0, 1.0)), at=1.0)
    scene = replace(BALL_CLAMPED, cuts=(cut,))
    mesh = base_mesh(scene, 150, 0)
    for each in (mesh, mesh.finer(np.ones(mesh.mesh.nelements), 2 * mesh.mesh.nelements)[0]):
        x, copies = nodes(each.solved), np.bincount(each.parent)[each.parent] > 1
        assert np.abs(x[copies, 2] - height).max() < 1e-12 * RADIUS
        rim = np.unique(each.body.rim(each.body.cut_faces)[1])
        np.testing.assert_allclose(np.linalg.norm(nodes(each.mesh)[rim], axis=1), RADIUS, rtol=1e-12)
        facets = facet_nodes(each.solved)
        disc = facets[copies[facets].all(axis=1) & (np.abs(x[facets[:, :3], 2] - height).max(axis=1) < 1e-9)]
        # Facets lie twice; as polygons of six points those at the rim lack half a per cent.
        ring = x[disc[:, [0, 3, 1, 4, 2, 5]]][..., :2]
        after = np.roll(ring, -1, axis=1)
        area = 0.5 * np.abs((ring[..., 0] * after[..., 1] - ring[..., 1] * after[..., 0]).sum(axis=1)).sum()
        assert area / 2 == pytest.approx(np.pi * (RADIUS**2 - height**2), rel=8e-3)


def test_what_is_far_from_the_true_shape_is_halved_until_it_is_near(mesh_cache):
    """The hanging spleen's coarsest mesh is 0.6 % of the size off."""
    mesh, distances = base_mesh(SPLEEN_SAG, 270, 0), []
    while True:
        surface = rest_surfaces(nodes(mesh.mesh), facet_nodes(mesh.mesh))
        distances.append(100 * shape_errors(SPLEEN_SAG.organ, surface, True).distance)
        if not mesh.far.any() or len(distances) > 3:
            break
        indicator = np.where(mesh.far, 1.0, 1e-6)
        mesh, _ = mesh.finer(indicator, mesh.mesh.nelements + 8 * int(mesh.far.sum()))
    assert distances[0] > REFERENCE_SHAPE > 0.85 * REFERENCE_SHAPE > distances[-1]
    stuck = np.unique(facet_nodes(mesh.mesh))
    assert not replace(mesh, back=stuck).far.any(), "what cannot be moved is not halved again"


@pytest.mark.campaign
def test_the_coarsest_mesh_keeps_the_area_that_is_held_and_no_part_of_it_folds():
    """At 270 surface nodes the end of the hilum is lost; the next finer mesh has an element that folds between the
    points where the reference integrates it."""
    scene = member("spleen", 0, 1)
    given = scene.reference.base
    plain = held_mesh(scene, mesh_for(scene, given, on_shape=True))
    corners = area_error(scene.organ, scene.held[0], plain.mesh.p.T, plain.patches[0])
    assert corners < -0.04, "an end is lost with so many nodes as the plan has"
    mesh = base_mesh(scene, given, 0)
    assert mesh.lost_area < LOST and given < len(np.unique(facet_nodes(mesh.mesh)[:, :3])) < 1.2 * given
    assert smallest_jacobian(mesh.points, element_nodes(mesh.mesh)).min() > 0.0
    halved = mesh.finer(np.ones(mesh.mesh.nelements), 2 * mesh.mesh.nelements)[0]
    check_neighbours(halved.mesh)  # refuses an element that folds
    assert halved.lost_area < LOST
