"""Nodes move as far as their elements allow."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import tetrahedron_volumes
from studies.meshing.quadratic_mesh import uprightness
from studies.meshing.retreat import FLOOR, STEP, retreat

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]])
CELLS = np.array([[0, 1, 2, 3], [0, 2, 1, 4]])


def measure(points, cells, which):
    return tetrahedron_volumes(points, cells) * 6.0


def test_a_move_that_harms_no_element_is_made_whole():
    moved = CORNERS + np.array([0.0, 0.0, 0.3])
    assert (retreat(CORNERS, moved, CELLS, measure, "two") == 1.0).all()


def test_a_node_that_would_turn_its_element_stops_before_and_the_others_go_on():
    """Node 3 sinks below the base of its element at half of its way: 1 - 2 s of the volume is left at a share s."""
    moved = CORNERS.copy()
    moved[3, 2], moved[4, 2] = -1.0, -2.0
    share = retreat(CORNERS, moved, CELLS, measure, "two")
    left = (1.0 - FLOOR) / 2.0
    assert left - STEP < share[3] <= left
    assert (np.delete(share, 3) == 1.0).all()


def test_an_element_that_is_flat_before_it_moves_is_an_error_with_its_place():
    flat = CORNERS.copy()
    flat[3, 2] = 0.0
    with pytest.raises(StudyError, match=r"^two: the element at \(250\.0, 250\.0, 0\.0\) mm is flat or"):
        retreat(flat, CORNERS, CELLS, measure, "two")


def quadratic(bend):
    """A quadratic tetrahedron with the middle of its first edge moved by `bend`."""
    pairs = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
    points = np.concatenate([CORNERS[:4], [CORNERS[list(pair)].mean(axis=0) for pair in pairs]])
    points[4] += bend
    return points, np.arange(10)[None], np.array([1.0 / 6.0])


def test_uprightness_is_one_when_straight_and_none_when_a_corner_folds():
    assert uprightness(*quadratic([0.0, 0, 0]))[0] == pytest.approx(1.0)
    # The tangent at the corner vanishes when the middle of the edge is a quarter of it away from that corner.
    assert uprightness(*quadratic([-0.2, 0, 0]))[0] > 0.0
    assert uprightness(*quadratic([-0.26, 0, 0]))[0] < 0.0
