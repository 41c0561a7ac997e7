"""Meshes with the volume of their shape, and outlines that stay where they belong."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import HalfSpace, check_surface, check_tetrahedra, organ, scan
from studies.geometry.mesh.organ_mesh import signed_volume, triangle_areas
from studies.geometry.organs import SHAPES
from studies.geometry.shape.regions import BallRegion
from studies.geometry.surface.first_surface import true_volume
from studies.geometry.surface.volume import depth, with_volume
from tests.campaigns import campaign
from tests.studies.geometry.boxes import box, split
from tests.studies.geometry.files import writers

MM = 1e-3
CAP = HalfSpace((0.020, 0.0, 0.0), (-1.0, 0.0, 0.0))
SPOT = BallRegion((0.0, 0.0, 0.020), 0.012)


@pytest.fixture(scope="module")
def egg(tmp_path_factory):
    """An ellipsoid of 60 x 50 x 40 mm in a file, and its points [m] and triangles."""
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=4)
    points *= np.array((30, 25, 20)) / np.linalg.norm(points, axis=1, keepdims=True)
    path = tmp_path_factory.mktemp("egg") / "egg.vtk"
    path.write_bytes(writers.legacy_vtk(points, faces, binary=True))
    return path, points * MM, faces


@pytest.mark.parametrize("nodes", [150, campaign(550)])
def test_a_scan_keeps_its_volume_and_its_outlines(egg, nodes):
    path, points, faces = egg
    mesh = scan(path, nodes, unit="mm", regions={"cap": CAP, "spot": SPOT})
    check_tetrahedra(mesh.points, mesh.tetrahedra)
    assert mesh.volume == pytest.approx(signed_volume(points, faces), rel=1e-5)
    assert mesh.outer_count == pytest.approx(nodes, rel=0.02)
    for name, region in (("cap", CAP), ("spot", SPOT)):
        level = region.level(mesh.points[: mesh.surface_count])
        edges = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        # No edge crosses an outline, so the held patch is the same on every mesh.
        crossing = (level[edges] > 1e-9).any(axis=1) & (level[edges] < -1e-9).any(axis=1)
        assert not crossing.any() and (np.sort(mesh.patches[name]) == np.flatnonzero(level <= 1e-9)).all()
        assert (np.abs(level) < 1e-9).sum() >= 6
    # The area of the cap of the true ellipsoid, by a fine triangulation.
    area = triangle_areas(points, faces)[points[faces].mean(axis=1)[:, 0] >= 0.020].sum()
    assert triangle_areas(mesh.points, mesh.patch_triangles("cap")).sum() == pytest.approx(area, rel=0.04)


@pytest.mark.parametrize("name", [campaign("bladder"), "kidney", campaign("liver"), campaign("stomach")])
def test_an_organ_has_its_true_volume_on_wish(name):
    mesh = organ(name, 200, exact=True)
    check_tetrahedra(mesh.points, mesh.tetrahedra)
    assert mesh.volume == pytest.approx(true_volume(SHAPES[name]()), rel=1e-3)
    assert organ(name, 200).volume < 0.99 * mesh.volume or SHAPES[name]().wall is not None


def test_nodes_go_as_far_as_the_surface_is_cut_off(balls):
    mesh = balls[150].outer()
    radius = 0.05

    def level(x):
        return np.linalg.norm(x, axis=1) - radius

    above = depth(mesh.points, mesh.triangles, level)
    # A chord of length e lies e^2 / (8 r) below the sphere.
    edge = np.sqrt(4 / np.sqrt(3) * triangle_areas(mesh.points, mesh.triangles).sum() / len(mesh.triangles))
    assert above.mean() == pytest.approx(edge**2 / (8 * radius), rel=0.1)
    true = 4 / 3 * np.pi * radius**3
    moved = with_volume(mesh.points, mesh.triangles, true, level)
    check_surface(moved, mesh.triangles)
    assert signed_volume(moved, mesh.triangles) == pytest.approx(true, rel=1e-6)
    went = np.linalg.norm(moved, axis=1) - np.linalg.norm(mesh.points, axis=1)
    assert np.corrcoef(went, above)[0, 1] > 0.95  # farther where the triangles around are larger
    # Part of the chords' depth is outside now: nearer to the sphere than before.
    off = [max(np.abs(level(np.vstack([x, x[mesh.triangles].mean(axis=1)])))) for x in (mesh.points, moved)]
    assert off[1] < 0.9 * off[0]
    with pytest.raises(StudyError, match="nodes cannot be moved so that the mesh has the shape"):
        with_volume(mesh.points, mesh.triangles, 2 * true, level)
