"""Signed distances on a grid against closed forms."""

import numpy as np
import pytest

from studies.geometry.scanned.distance_grid import BAND, distance_grid, winding_number
from tests.studies.geometry.boxes import box, box_distance, split, together

CELL = 0.1


def places(grid):
    axes = [grid.low[k] + grid.cell * np.arange(grid.values.shape[k]) for k in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def test_distance_to_a_box_is_the_closed_form():
    # The grid has rows in the faces, edges and diagonals of the box: nothing about a ray may depend on luck.
    grid = distance_grid(*box(), CELL, margin=1.0)
    exact = box_distance(places(grid))
    error = np.abs(grid.values.ravel() - exact)
    near = np.abs(exact) < BAND * CELL
    assert error[near].max() < 1e-12
    # Farther out the distance may be that to a neighbour of the nearest triangle, half a cell away: 0.5² / 8 of a cell.
    assert error.max() < 0.03 * CELL
    assert (grid.low <= -1.0).all() and (grid.high >= 2.0).all()


def test_parts_that_overlap_count_once_and_lumens_not():
    two = together(box(), box((0.5, 0.25, 0.25), (1.5, 0.75, 0.75)))
    grid = distance_grid(*two, CELL / 2, margin=0.3)
    inside = (box_distance(places(grid)) < 0) | (box_distance(places(grid), (0.5, 0.25, 0.25), (1.5, 0.75, 0.75)) < 0)
    clear = np.abs(grid.values.ravel()) > 1e-9
    assert ((grid.values.ravel() < 0) == inside)[clear].all()
    inner, faces = box((0.3, 0.3, 0.3), (0.7, 0.7, 0.7))
    hollow = together(box(), (inner, faces[:, ::-1]))
    grid = distance_grid(*hollow, CELL / 2, margin=0.3)
    assert grid.volume == pytest.approx(1.0 - 0.4**3, rel=0.01)  # planes in and between rows: half a cell is exact


def test_winding_number_counts_with_sign():
    axes = [np.linspace(-0.5, 1.5, 9)] * 3
    once = winding_number(*box(), axes)
    twice = winding_number(*together(box(), box()), axes)
    points, faces = box()
    assert set(np.unique(once)) == {0, 1}
    assert (twice == 2 * once).all()
    assert (winding_number(points, faces[:, ::-1], axes) == -once).all()


@pytest.mark.parametrize("turn", [0, 1, 2])
def test_volume_of_a_fine_sphere(turn):
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=4)
    points = np.roll(points / np.linalg.norm(points, axis=1, keepdims=True), turn, axis=1)
    grid = distance_grid(points, faces, 0.1, margin=0.3)
    # The polyhedron is 0.5 % too small; the cells' shares are exact for planes.
    assert grid.volume == pytest.approx(4 / 3 * np.pi, rel=0.01)
    f = grid.level()
    assert f(places(grid)) == pytest.approx(grid.values.ravel(), abs=1e-12)
    between = np.random.default_rng(turn).normal(size=(500, 3))
    between *= np.random.default_rng(turn).uniform(0.8, 1.1, (500, 1)) / np.linalg.norm(between, axis=1, keepdims=True)
    # Edges of up to 0.2 leave 0.2²/8 between polyhedron and sphere.
    assert np.abs(f(between) - (np.linalg.norm(between, axis=1) - 1)).max() < 5e-3
