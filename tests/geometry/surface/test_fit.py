"""Nodes where even ones cut corners, and none that spoils the mesh."""

import numpy as np
import pytest

from studies.geometry.mesh.quality import triangle_radius_ratio
from studies.geometry.surface.distance import distance_to_surface
from studies.geometry.surface.fit import ALLOWED, evenly_spread, folded_pairs, refined, unspoilt
from studies.geometry.surface.intersections import crossing_triangles
from studies.geometry.surface.node_count import MOST
from tests.geometry.boxes import box, split


@pytest.fixture
def lens():
    """A flat lens with a sharp rim, coarse, and fine samples of it."""

    def bent(times):
        points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=times)
        points = points / np.linalg.norm(points, axis=1, keepdims=True)
        radius = np.linalg.norm(points[:, :2], axis=1)
        return np.column_stack([points[:, :2], np.sign(points[:, 2]) * 0.3 * (1 - radius**2)]), faces

    return *bent(2), bent(5)[0]


def test_nodes_go_where_the_mesh_cuts_corners():
    # A ball with one narrow tip, between the nodes of the coarse mesh.
    tip = np.array([0.3, 0.25, 0.92]) / np.linalg.norm([0.3, 0.25, 0.92])

    def tipped(times):
        points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=times)
        points = points / np.linalg.norm(points, axis=1, keepdims=True)
        return points * (1 + 0.4 * np.exp(-(((points @ tip - 1) / 0.02) ** 2)))[:, None], faces

    points, faces = tipped(3)
    samples = np.vstack([tipped(5)[0], 1.4 * tip])
    before = distance_to_surface(samples, points, faces).max()
    new, triangles = refined(points, faces, samples, len(points) + 12)
    assert before > 0.1
    assert len(points) < len(new) <= len(points) + 12 and len(triangles) == 2 * len(new) - 4
    assert (new[: len(points)] == points).all()
    assert distance_to_surface(samples, new, triangles).max() < 0.5 * before
    assert triangle_radius_ratio(new, triangles).min() > 0.2 and len(crossing_triangles(new, triangles)) == 0


def test_a_mesh_that_is_near_enough_is_left_alone():
    points, faces = split(*box(), times=3)
    inner = points[::3] + 1e-3 * ALLOWED
    new, triangles = refined(points, faces, inner, len(points) + 5)
    assert (new == points).all() and (triangles == faces).all()


def test_nodes_that_spoil_the_mesh_go_back(lens):
    points, faces, _ = lens
    far, folded, flat = points.copy(), points.copy(), points.copy()
    top = points[:, 2].argmax()
    far[top] -= (0, 0, 1.0)  # through the other side
    neighbour = np.setdiff1d(faces[(faces == top).any(axis=1)][0], top)[0]
    folded[top] = points[top] + 1.7 * (points[neighbour] - points[top]) + (0, 0, 1e-3)
    flat[top] = points[top] + 0.97 * (points[neighbour] - points[top])
    sound = points.copy()
    sound[top] += (0, 0, 0.02)
    for moved in (far, folded, flat):
        assert (unspoilt(points, moved, faces) == points).all()
    assert (unspoilt(points, sound, faces) == sound).all()


def test_folds_are_pairs_of_neighbours_back_to_back():
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, 0.9, 0.1], [0.5, -1, 0]], float)
    assert folded_pairs(points, np.array([[0, 1, 2], [1, 0, 3]])).tolist() == [[0, 1]]
    assert len(folded_pairs(points, np.array([[0, 1, 2], [1, 0, 4]]))) == 0


def test_some_nodes_are_spared_between_the_limits():
    assert evenly_spread(550) == 528 and evenly_spread(60) == 60
    assert (
        evenly_spread(10) == 10 and evenly_spread(MOST + 1) == MOST + 1
    )  # refused further on, by the number asked for
