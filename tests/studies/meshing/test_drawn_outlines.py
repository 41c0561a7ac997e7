"""Middles of sides that leave an outline, drawn to it in graded quadratic bodies."""

import numpy as np
import pytest

from studies.geometry.mesh.quality import PAIRS
from studies.meshing import graded_mesh as grading
from studies.meshing.graded_mesh import graded_mesh, mesh_at, middles
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.library.liver_probe import LIVER_PROBE
from studies.scene.library.spleen_sag import SPLEEN_SAG

LEVEL = 149


def rim_of(mesh):
    """Vertices on the outlines of the patches: on sides of one facet only."""
    vertices = []
    for patch in mesh.patches.values():
        corners = mesh.facets[np.isin(mesh.facets[:, :3], patch).all(axis=1)][:, :3]
        sides, count = np.unique(
            np.sort(corners[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2), axis=1), axis=0, return_counts=True
        )
        vertices.append(sides[count == 1].ravel())
    return np.concatenate(vertices)


def test_middles_of_sides_that_leave_an_outline_are_drawn_to_it(monkeypatch, mesh_cache):
    """To 0.4 of the side from the outline; no vertex moves, and no other middle. None of an even body is."""
    drawn, even = (mesh_at(BALL_CLAMPED, LEVEL, halvings, 0, True) for halvings in (1, 0))
    monkeypatch.setattr(grading, "middles", lambda scene: 0.5)
    plain = mesh_at(BALL_CLAMPED, LEVEL, 1, 0, True)
    np.testing.assert_array_equal(even.points, mesh_at(BALL_CLAMPED, LEVEL, 0, 0, True).points)
    np.testing.assert_array_equal(drawn.cells, plain.cells)
    ends, middles = plain.cells[:, PAIRS].reshape(-1, 2), plain.cells[:, 4:].ravel()
    on = np.isin(ends, rim_of(plain))
    leaving = on.sum(axis=1) == 1
    moved = np.linalg.norm(drawn.points - plain.points, axis=1) > 1e-9
    assert set(np.flatnonzero(moved)) <= set(middles[leaving])
    near, far = (plain.points[ends[leaving][chosen[leaving]]] for chosen in (on, ~on))
    middle = middles[leaving]
    # The parabola through the three nodes of a side, at 0.4.
    places = 0.12 * near - 0.08 * far + 0.96 * plain.points[middle]
    there = np.linalg.norm(drawn.points[middle] - places, axis=1) < 1e-9
    assert there.mean() > 0.9  # a few are held back, lest elements fold
    assert drawn.smallest_jacobian > 0


@pytest.mark.parametrize(
    ("scene", "share"), [(BALL_CLAMPED, 0.4), (LIVER_PROBE, 0.4), (SPLEEN_SAG, 0.45), (BALL_SQUEEZE, 0.5)]
)
def test_what_its_weight_bends_is_drawn_less(scene, share):
    """Its strains at the outline are not small. What is not held has no outline."""
    assert middles(scene) == share


@pytest.mark.campaign
def test_a_body_that_nothing_holds_is_graded_too(mesh_cache):
    assert graded_mesh(BALL_SQUEEZE, 600, 1, 1, True).smallest_jacobian > 0
