"""A scan as a level set: folds closed, bumps levelled, shells filled, volume kept."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import signed_volume
from studies.geometry.scanned.distance_grid import distance_grid
from studies.geometry.scanned.level_grid import shape_of
from studies.geometry.scanned.scan_shape import cell_for, levelled, solidified, target_volume, true_grid
from studies.geometry.surface.first_surface import enclosed_volume, first_surface
from tests.studies.geometry.boxes import box, box_distance, split, together

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
    cell = cell_for(points, faces, 550)
    shape = shape_of(distance_grid(points, faces, cell, 4 * cell), "box")
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
    for smooth, least, most in ((0.0, 4 * MM, np.inf), (7 * MM, -np.inf, -4 * MM), (3 * MM, 3 * MM, np.inf)):
        body = levelled(points, faces, 2.5 * MM, smooth, "u") if smooth else (points, faces)
        shape = shape_of(distance_grid(*body, 2.5 * MM, 10 * MM), "u")
        assert least < shape.level(inside) < most
        assert smooth < 7 * MM or signed_volume(*body) == pytest.approx(volume + cleft, rel=0.02)


def test_bumps_are_levelled_and_the_volume_is_kept():
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=5)
    direction = points / np.linalg.norm(points, axis=1, keepdims=True)
    rough = 0.05 * direction * (1 + 0.03 * np.sin(25 * points[:, :1]) * np.cos(25 * points[:, 1:2]))
    new, triangles = levelled(rough, faces, 2 * MM, 6 * MM, "rough")
    distance = np.linalg.norm(new, axis=1)
    assert distance.std() < 0.5 * np.linalg.norm(rough, axis=1).std()
    # Closing fills the dimples, so the volume may grow by what they held: under 3 % x 3.
    assert 0.999 < signed_volume(new, triangles) / signed_volume(rough, faces) < 1.05


AXES = np.array((0.030, 0.025, 0.020))
BALL = split(*box((-1, -1, -1), (1, 1, 1)), times=4)
EGG = AXES * BALL[0] / np.linalg.norm(BALL[0], axis=1, keepdims=True)
VOLUME = signed_volume(EGG, BALL[1])


def test_a_capsule_is_filled():
    """Two sheets 0.5 mm apart with an opening of 6 mm, and a surface with a hole: openings of 8 mm are closed."""
    middles = EGG[BALL[1]].mean(axis=1)
    faces = BALL[1][(middles[:, 2] < 0) | (np.linalg.norm(middles[:, :2], axis=1) > 3 * MM)]
    for shell in (together((EGG, faces), (EGG * (1 - 0.5 * MM / AXES), faces[:, ::-1])), (EGG, faces)):
        points, triangles = solidified(*shell, 8 * MM, "capsule")
        assert signed_volume(points, triangles) == pytest.approx(VOLUME, rel=0.04)
        assert np.abs(np.linalg.norm(points / AXES, axis=1) - 1).max() < 0.1


def test_the_true_shape_has_the_volume_of_the_surface_and_cells_as_fine_as_it_asks_for():
    grid = true_grid(EGG, BALL[1], "egg")
    shape = shape_of(grid, "egg")
    assert enclosed_volume(shape, 1) == pytest.approx(VOLUME, rel=1e-6)
    assert np.abs(shape.level(EGG)).max() < 0.1 * grid.cell
    assert grid.cell == pytest.approx(2 * np.linalg.norm(AXES) / 40, rel=1e-2)
    points = EGG.copy()
    points[(np.abs(points[:, 2]) < 0.0026) & (points[:, 1] > 0.010), 1] += 0.008  # a thin flap at its side
    assert true_grid(points, BALL[1], "flap").cell < 0.7 * grid.cell


def test_parts_that_overlap_count_once():
    assert target_volume(box(), 0.99) == pytest.approx(1.0)
    assert target_volume(box(), 0.6) == 0.6


def test_what_would_leave_nothing_is_refused():
    with pytest.raises(StudyError, match=r"smoothing over 30 mm would leave nothing of a body of 87\.7 mm"):
        levelled(*split(*box(high=(0.06, 0.05, 0.04))), 1 * MM, 30 * MM, "box")
    bowl = BALL[1][EGG[BALL[1]].mean(axis=1)[:, 2] < -5 * MM]
    with pytest.raises(StudyError, match=r"bowl: the surface encloses nothing when openings up to 3 mm are closed"):
        solidified(EGG, bowl, 3 * MM, "bowl")
    with pytest.raises(StudyError, match=r"bowl: openings of 60 mm are wider than half of the body's size, .* mm;"):
        solidified(EGG, bowl, 60 * MM, "bowl")
