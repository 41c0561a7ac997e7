"""Meshes on whose faces a cut lies: the section in its plane, the front on the blade's edge, both sides filled."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

from massspring.body.opening import opened
from massspring.body.partition import cell_graph
from studies.base.errors import StudyError
from studies.geometry import BallRegion, HalfSpace, Region, organ
from studies.geometry.mesh.checks import check_tetrahedra
from studies.geometry.mesh.organ_mesh import (
    boundary_triangles,
    same_triangles,
    tetrahedron_volumes,
    triangle_areas,
    unique_edges,
)
from studies.geometry.mesh.quality import dihedral_angles
from studies.geometry.mesher.section import loops, section

MIDDLE = HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
HALF = HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
DISC = BallRegion((0.0, 0.0, 0.0), 0.02)
LIVER_CUT = HalfSpace((0.02, 0.0, 0.0), (1.0, 0.0, 0.0)), HalfSpace((0.0, 0.0, 0.015), (0.0, 0.0, -1.0))


@dataclass(frozen=True)
class Cut:
    plane: HalfSpace = MIDDLE
    within: Region | None = None
    name: str = "cut"


def euler(triangles: np.ndarray) -> int:
    return len(np.unique(triangles)) - len(unique_edges(triangles)) + len(triangles)


@pytest.mark.parametrize(
    ("name", "cut", "euler_after", "pieces"),
    [
        ("ball", Cut(), 4, 2),
        ("ball", Cut(within=HALF), 2, 1),
        ("ball", Cut(within=DISC), 4, 1),
        ("liver", Cut(*LIVER_CUT), 2, 1),
    ],
)
def test_a_cut_lies_on_faces_along_which_the_mesh_opens(name, cut, euler_after, pieces):
    mesh = organ(name, 350, {}, cuts=(cut,))
    check_tetrahedra(mesh.points, mesh.tetrahedra, mesh.name)
    assert same_triangles(boundary_triangles(mesh.tetrahedra), mesh.triangles)
    assert dihedral_angles(mesh.points, mesh.tetrahedra).min() > 10.0
    faces = mesh.cuts["cut"]
    size = np.ptp(mesh.points)
    assert np.abs(cut.plane.level(mesh.points[faces])).max() < 1e-12 * size
    a, b, c = mesh.points[faces].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a) @ cut.plane.normal > 0).all()
    opening = opened(mesh.tetrahedra, faces, len(mesh.points))
    assert euler(boundary_triangles(opening.cells.astype(np.int64))) == euler_after
    label = connected_components(cell_graph(mesh.points[opening.parent], opening.cells), directed=False)[1]
    assert label.max() + 1 == pieces
    volumes = tetrahedron_volumes(mesh.points, mesh.tetrahedra)
    parts = [volumes[label == k].sum() for k in range(pieces)]
    assert sum(parts) == pytest.approx(mesh.volume, rel=1e-13, abs=0)
    if pieces == 2:
        np.testing.assert_allclose(parts, 0.5 * mesh.volume, rtol=5e-3)


def test_the_front_is_exactly_on_the_edge_of_the_blade_and_the_area_is_that_of_the_section():
    for within, area in ((None, np.pi * 0.05**2), (HALF, 0.5 * np.pi * 0.05**2), (DISC, np.pi * 0.02**2)):
        mesh = organ("ball", 350, {}, cuts=(Cut(within=within),))
        faces = mesh.cuts["cut"]
        assert triangle_areas(mesh.points, faces).sum() == pytest.approx(area, rel=0.03)
        if within is not None:
            sides, count = np.unique(
                np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0, return_counts=True
            )
            rim = np.unique(sides[count == 1])
            front = rim[np.linalg.norm(mesh.points[rim], axis=1) < 0.049]
            assert len(front) >= 5
            assert np.abs(within.level(mesh.points[front])).max() < 1e-12


@pytest.mark.parametrize("seed", range(4))
def test_random_sections_of_organs(seed):
    random = np.random.default_rng(seed)
    normal = random.standard_normal(3)
    mesh = organ(("ball", "liver", "kidney")[seed % 3], 350, {}, cuts=(Cut(HalfSpace((0.0, 0.0, 0.0), tuple(normal))),))
    opening = opened(mesh.tetrahedra, mesh.cuts["cut"], len(mesh.points))
    assert len(opening.pairs) > 30
    assert tetrahedron_volumes(mesh.points, mesh.tetrahedra).sum() == pytest.approx(mesh.volume, rel=1e-12, abs=0)


def test_a_triangle_of_the_surface_that_lies_in_the_plane_belongs_to_the_body_next_to_it():
    """Three nodes of the trace make one here; counted to the other side, it lies on a face of the section."""
    plane = HalfSpace((0.00403777, 0.00666823, 0.00125052), (-0.51142751, -0.84460292, -0.15839131))
    mesh = organ("liver", 350, {}, cuts=(Cut(plane),))
    on = np.abs(plane.level(mesh.points)) < 1e-9
    assert on[mesh.triangles].all(axis=1).any()
    assert len(opened(mesh.tetrahedra, mesh.cuts["cut"], len(mesh.points)).pairs) > 30


@pytest.mark.parametrize(
    ("cut", "regions", "sentence"),
    [
        (Cut(HalfSpace((0.0, 0.0, 0.06), (0.0, 0.0, 1.0))), {}, "the plane of cut 'cut' misses the body"),
        (Cut(HalfSpace((0.0, 0.0, 0.0495), (0.0, 0.0, 1.0))), {}, "leaves a piece of .* % of the volume"),
        (Cut(within=HalfSpace((0.1, 0.0, 0.0), (-1.0, 0.0, 0.0))), {}, "holds nothing of the section"),
        (Cut(within=HalfSpace((0.1, 0.0, 0.0), (1.0, 0.0, 0.0))), {}, "is all of it; leave out within"),
        (Cut(within=BallRegion((0.0, 0.0, 0.0), 0.06)), {}, "the disc of cut 'cut' reaches the surface"),
        (Cut(within=BallRegion((0.0, 0.0, 0.03), 0.02)), {}, "holds nothing of the plane"),
        (Cut(within=BallRegion((0.0, 0.0, 0.0), 0.0492)), {}, "has its front so near to the surface that an angle"),
        (Cut(), {"side": HalfSpace((-0.02, 0.0, 0.0), (1.0, 0.0, 0.0))}, "crosses the outline of a held region"),
    ],
)
def test_cuts_that_cannot_be_are_refused(cut, regions, sentence):
    with pytest.raises(StudyError, match=sentence):
        organ("ball", 350, regions, cuts=(cut,))


def test_bare_surfaces_are_not_cut_yet():
    with pytest.raises(StudyError, match="is for an organ that is filled; surfaces are not cut yet"):
        organ("ball", 400, {}, False, cuts=(Cut(),))


def test_loops_follow_their_edges():
    edges = np.array([[0, 3], [3, 1], [1, 0], [7, 5], [5, 6], [6, 8], [8, 7]])
    polygons = loops(edges)
    assert [sorted(loop) for loop in polygons] == [[0, 1, 3], [5, 6, 7, 8]]
    for loop in polygons:
        steps = {tuple(sorted(pair)) for pair in zip(loop, np.roll(loop, -1), strict=True)}
        assert steps <= {tuple(sorted(edge)) for edge in edges.tolist()}


@pytest.mark.parametrize("within", [None, BallRegion((0.0, 0.0, 0.0), 0.1)])
def test_a_plane_without_an_edge_of_the_surface_is_a_sentence(within):
    """Of a coarse surface a cut of a few per mille may have none."""
    plane = HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    with pytest.raises(StudyError, match="cut 'a': no edge of the surface lies in its plane"):
        section(plane, np.eye(3), np.empty((0, 2), int), within, "cut 'a'")
