"""The one true shape of a scan: its volume, its cells, its name in the cache."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import curved, scan, true_shape_of
from studies.geometry.files.units import Source
from studies.geometry.mesh.organ_mesh import signed_volume
from studies.geometry.scanned.scan_shape import target_volume, true_grid
from studies.geometry.surface.first_surface import enclosed_volume, true_volume
from tests.studies.geometry.boxes import box, split
from tests.studies.geometry.files import writers

AXES = np.array((0.030, 0.025, 0.020))


@pytest.fixture(scope="module")
def egg(tmp_path_factory):
    """An ellipsoid with semi-axes of 30, 25 and 20 mm: a file in millimetres, points [m], triangles."""
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=4)
    points *= AXES / np.linalg.norm(points, axis=1, keepdims=True)
    path = tmp_path_factory.mktemp("true") / "egg.vtk"
    path.write_bytes(writers.legacy_vtk(1e3 * points, faces, binary=True))
    return path, points, faces


@pytest.fixture(scope="module")
def shape(egg, mesh_cache):
    return true_shape_of(Source(egg[0], "mm"))


def test_the_shape_has_the_volume_of_the_surface(egg, shape):
    assert enclosed_volume(shape, 1) == pytest.approx(signed_volume(*egg[1:]), rel=1e-6)
    assert np.abs(shape.level(egg[1])).max() < 0.1 * shape.cell


def test_cells_are_fine_where_the_surface_asks_for_them(egg, shape):
    """The coarsest cells resolve a smooth egg; one with a thin flap at its side needs finer ones."""
    diagonal = 2 * np.linalg.norm(AXES)
    assert shape.cell == pytest.approx(diagonal / 40, rel=1e-2)
    points = egg[1].copy()
    near = (np.abs(points[:, 2]) < 0.0026) & (points[:, 1] > 0.010)
    points[near, 1] += 0.008
    assert true_grid(points, egg[2], "flap").cell < 0.7 * shape.cell


def test_a_hollow_scan_has_a_wall_on_its_true_shape(egg, mesh_cache):
    source = Source(egg[0], "mm")
    shape = true_shape_of(source, wall=0.004)
    mesh = scan(source, 200, wall=0.004, layers=1, on_shape=True)
    made = curved(mesh, shape=shape)
    assert made.volume == pytest.approx(true_volume(shape), rel=2e-3)
    assert shape.wall == 0.004


def test_two_surfaces_are_two_shapes(egg, tmp_path, mesh_cache):
    """The cache of curved meshes has the shape in its key: another shape curves the same flat mesh again."""
    source = Source(egg[0], "mm")
    mesh = scan(source, 150, on_shape=True)
    one, other = (curved(mesh, shape=true_shape_of(source, smooth=smooth)) for smooth in (0.0, 0.004))
    middles = one.points[len(mesh.points) :] - other.points[len(mesh.points) :]
    assert np.abs(middles).max() > 1e-6


def test_parts_that_overlap_count_once():
    assert target_volume(box(), 0.99) == pytest.approx(1.0)
    assert target_volume(box(), 0.6) == 0.6


def test_an_open_surface_has_no_shape(egg, tmp_path):
    path = tmp_path / "open.vtk"
    path.write_bytes(writers.legacy_vtk(1e3 * egg[1], egg[2][40:], binary=True))
    with pytest.raises(StudyError, match="open at"):
        true_shape_of(Source(path, "mm"))
