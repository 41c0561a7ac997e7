"""Cells divided at a sheet: nothing is lost, neighbours agree, and a blade covers what it covers."""

import numpy as np
import pytest

from massspring.body.virtual_nodes import part_in_front
from studies.geometry.mesh.clipped import covered_part, crossing_edges, crossings, divided
from studies.geometry.mesh.organ_mesh import boundary_triangles, signed_volume, tetrahedron_volumes, triangle_areas
from tests.massspring.conftest import block

HEIGHT = 0.031
"""Of the plane through the block of 0.06 m [m]: through cells, near no layer of nodes."""


@pytest.fixture(scope="module")
def mesh() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    points, _, cells = block((4, 4, 3), distortion=0.3)
    return points, cells.astype(np.int64), points @ [0.1, -0.2, 1.0] - HEIGHT


def test_the_pieces_of_a_cell_have_its_volume_and_share(mesh):
    points, cells, level = mesh
    edges = crossing_edges(cells, level)
    pieces, side = divided(points, cells, level, edges)
    places = np.concatenate([points, crossings(points, level, edges)[1]])
    volumes = tetrahedron_volumes(places, pieces)
    crossed = cells[np.ptp(np.sign(level[cells]), axis=1) > 0]
    assert (volumes > 0).all() and len(crossed) > 50
    whole = tetrahedron_volumes(points, crossed)
    assert volumes.sum() == pytest.approx(whole.sum(), rel=1e-13)
    front = part_in_front(level[crossed]) @ whole
    assert volumes[side > 0].sum() == pytest.approx(front, rel=1e-12)
    beyond = np.concatenate([level, np.zeros(len(edges))])[pieces]
    assert (beyond[side > 0] >= 0).all() and (beyond[side < 0] <= 0).all()


def test_neighbours_and_both_sides_divide_their_common_faces_alike(mesh):
    """Else faces inside would be left over as boundary."""
    points, cells, level = mesh
    edges = crossing_edges(cells, level)
    pieces, _ = divided(points, cells, level, edges)
    places = np.concatenate([points, crossings(points, level, edges)[1]])
    whole = cells[np.ptp(np.sign(level[cells]), axis=1) == 0]
    triangles = boundary_triangles(np.concatenate([whole, pieces]))
    outside = boundary_triangles(cells)
    assert triangle_areas(places, triangles).sum() == pytest.approx(triangle_areas(points, outside).sum(), rel=1e-12)
    assert signed_volume(places, triangles) == pytest.approx(signed_volume(points, outside), rel=1e-12)


def test_a_blade_covers_its_part_of_a_section():
    # Sections of a corner and of a wedge; halves, quarters by their centre lines.
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    cells = np.array([[0, 1, 2, 3]])
    everything, nothing = (lambda x: np.ones(len(x), bool)), (lambda x: np.zeros(len(x), bool))
    for level in (points.sum(axis=1) - 0.5, points[:, 0] + points[:, 1] - 0.5, 0.5 - points.sum(axis=1)):
        assert covered_part(points, cells, level, everything) == pytest.approx([1.0])
        assert covered_part(points, cells, level, nothing) == pytest.approx([0.0])
        half = covered_part(points, cells, level, lambda x: x[:, 0] < x[:, 1])
        assert half == pytest.approx([0.5], abs=0.07)
    assert covered_part(points, cells, points[:, 0] + 1.0, everything) == pytest.approx([0.0])


def test_the_parts_of_a_disc_add_up_to_its_area(mesh):
    points, cells, _ = mesh
    level = points[:, 2] - HEIGHT
    centre, radius = np.array([0.04, 0.04, HEIGHT]), 0.025
    part = covered_part(points, cells, level, lambda x: np.linalg.norm(x - centre, axis=1) < radius)
    edges = crossing_edges(cells, level)
    pieces, side = divided(points, cells, level, edges)
    flat = boundary_triangles(pieces[side > 0])
    flat = flat[(flat >= len(points)).all(axis=1)]
    places = np.concatenate([points, crossings(points, level, edges)[1]])
    section = triangle_areas(places, flat).sum()
    # Of each cell alone, by its own pieces.
    area = 0.0
    for cell in np.flatnonzero(part > 0):
        own, at = divided(points, cells[[cell]], level, edges)
        faces = boundary_triangles(own[at > 0])
        area += part[cell] * triangle_areas(places, faces[(faces >= len(points)).all(axis=1)]).sum()
    assert section == pytest.approx(0.08 * 0.08, rel=0.05)
    assert area == pytest.approx(np.pi * radius**2, rel=0.02)
