"""A scan as a level set: folds closed, bumps levelled, volume kept."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import signed_volume
from studies.geometry.scanned.scan_shape import scan_shape, smoothed
from studies.geometry.surface.first_surface import first_surface
from tests.studies.geometry.boxes import box, box_distance, split

MM = 1e-3
CUT = (20.0, 30.0)
"""A cleft from x = 20 to 30 mm into the top of a block of 50 x 50 x 50 mm, 35 mm deep."""


def cleft_block():
    """A block with a deep fold 10 mm wide: the outline of a U, extruded along y."""
    outline = np.array([[0, 0], [50, 0], [50, 50], [30, 50], [30, 15], [20, 15], [20, 50], [0, 50]], float)
    caps = np.array([[0, 1, 4], [0, 4, 5], [0, 5, 7], [5, 6, 7], [1, 2, 4], [2, 3, 4]])
    count = len(outline)
    points = np.vstack([np.insert(outline, 1, y, axis=1) for y in (0.0, 50.0)]) * MM
    i = np.arange(count)
    j = (i + 1) % count
    sides = np.vstack([np.column_stack([j, i, i + count]), np.column_stack([j, i + count, j + count])])
    faces = np.vstack([caps, caps[:, ::-1] + count, sides])
    return points, faces if signed_volume(points, faces) > 0 else faces[:, ::-1]


def test_shape_of_a_box_is_the_box():
    points, faces = split(*box(high=(0.06, 0.05, 0.04)), times=2)
    shape = scan_shape(points, faces, 550)
    queries = np.random.default_rng(0).uniform((-0.003,) * 3, (0.063, 0.053, 0.043), (2000, 3))
    exact = box_distance(queries, high=(0.06, 0.05, 0.04))
    # Between grid points the spline rounds a crease of the distance off, by less than a quarter of a cell.
    near = np.abs(exact) < 2 * shape.cell
    assert np.abs(shape.level(queries) - exact)[near].max() < 0.25 * shape.cell
    fine, triangles = first_surface(shape)
    assert signed_volume(fine, triangles) == pytest.approx(0.06 * 0.05 * 0.04, rel=0.02)


def test_deep_folds_are_closed_and_wide_ones_are_not():
    points, faces = cleft_block()
    volume, cleft = signed_volume(points, faces), 10 * 35 * 50 * MM**3
    assert volume == pytest.approx((50**3 - 10 * 35 * 50) * MM**3, rel=1e-12)
    inside = np.array([[25.0, 25, 35]]) * MM
    assert scan_shape(points, faces, 150).level(inside) > 4 * MM
    assert scan_shape(points, faces, 150, smooth=7 * MM).level(inside) < -4 * MM
    assert scan_shape(points, faces, 150, smooth=3 * MM).level(inside) > 3 * MM
    closed = smoothed(points, faces, 2.5 * MM, 7 * MM, "u")
    assert signed_volume(*closed) == pytest.approx(volume + cleft, rel=0.02)


def test_bumps_are_levelled_and_the_volume_is_kept():
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=5)
    direction = points / np.linalg.norm(points, axis=1, keepdims=True)
    rough = 0.05 * direction * (1 + 0.03 * np.sin(25 * points[:, :1]) * np.cos(25 * points[:, 1:2]))
    new, triangles = smoothed(rough, faces, 2 * MM, 6 * MM, "rough")
    distance = np.linalg.norm(new, axis=1)
    assert distance.std() < 0.5 * np.linalg.norm(rough, axis=1).std()
    # Closing fills the dimples, so the volume may grow by what they held: under 3 % x 3.
    assert 0.999 < signed_volume(new, triangles) / signed_volume(rough, faces) < 1.05


def test_smoothing_longer_than_the_body_is_refused():
    with pytest.raises(StudyError, match=r"smoothing over 30 mm would leave nothing of a body of 87\.7 mm"):
        scan_shape(*split(*box(high=(0.06, 0.05, 0.04))), 550, smooth=0.03)
