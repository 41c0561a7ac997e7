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
    counted_edges,
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
    ("name", "cut", "euler_after", "pieces", "area"),
    [
        ("ball", Cut(), 4, 2, np.pi * 0.05**2),
        ("ball", Cut(within=HALF), 2, 1, 0.5 * np.pi * 0.05**2),
        ("ball", Cut(within=DISC), 4, 1, np.pi * 0.02**2),
        ("liver", Cut(*LIVER_CUT), 2, 1, None),
        ("kidney", Cut(HalfSpace((0.0, 0.0, 0.0), (0.3, -1.1, 0.6))), 4, 2, None),
    ],
)
def test_a_cut_lies_on_faces_along_which_the_mesh_opens(name, cut, euler_after, pieces, area):
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
    assert area is None or triangle_areas(mesh.points, faces).sum() == pytest.approx(area, rel=0.03)
    if cut.within is not None:
        sides, count = counted_edges(faces)
        rim = np.unique(sides[count == 1])
        front = rim[~np.isin(rim, mesh.triangles)]
        assert len(front) >= 4 and np.abs(cut.within.level(mesh.points[front])).max() < 1e-12
    if name == "ball" and pieces == 2:
        np.testing.assert_allclose(parts, 0.5 * mesh.volume, rtol=5e-3)


def test_a_triangle_of_the_surface_that_lies_in_the_plane_belongs_to_the_body_next_to_it():
    """Three nodes of the trace make one here; counted to the other side, it lies on a face of the section."""
    plane = HalfSpace((0.00403777, 0.00666823, 0.00125052), (-0.51142751, -0.84460292, -0.15839131))
    mesh = organ("liver", 350, {}, cuts=(Cut(plane),))
    on = np.abs(plane.level(mesh.points)) < 1e-9
    assert on[mesh.triangles].all(axis=1).any()
    assert len(opened(mesh.tetrahedra, mesh.cuts["cut"], len(mesh.points)).pairs) > 30


@pytest.mark.parametrize(
    ("cut", "regions", "sentence"),
    [  # The others are surface/sheet.py's.
        (Cut(HalfSpace((0.0, 0.0, 0.06), (0.0, 0.0, 1.0))), {}, "the plane of cut 'cut' misses the body"),
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
