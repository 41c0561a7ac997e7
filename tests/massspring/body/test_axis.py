"""The axis of a surface body: straight for a compact organ, the centre line for a bent one."""

import numpy as np
import pytest

from massspring.body.axis import AXES, virtual_nodes
from tests.massspring.conftest import icosphere

RADIUS, TUBE, SPACING = 0.10, 0.03, 0.015
"""Half a ring [m]: radius of its centre line, radius of its blunt tube, spacing of the virtual nodes."""


def half_ring() -> tuple[np.ndarray, np.ndarray]:
    """A closed tube bent to half a circle around y: points (n, 3) [m] and outward triangles."""
    ball, triangles = icosphere(3, 1.0)
    across = np.hypot(ball[:, 0], ball[:, 1])
    outward = ball[:, :2] / np.maximum(across, 1e-9)[:, None]
    tube = TUBE * (1.0 - np.abs(ball[:, 2]) ** 6) ** (1 / 6)
    angle = 0.5 * np.pi * ball[:, 2]
    rho = RADIUS + tube * outward[:, 0]
    return np.column_stack([rho * np.cos(angle), tube * outward[:, 1], rho * np.sin(angle)]), triangles


def off_centre(nodes: np.ndarray) -> np.ndarray:
    """Distance of nodes from the circle in the middle of the tube [m]."""
    return np.hypot(np.hypot(nodes[:, 0], nodes[:, 2]) - RADIUS, nodes[:, 1])


def test_the_centre_line_of_half_a_ring_is_half_a_circle():
    nodes = virtual_nodes(*half_ring(), SPACING, "centre_line")
    # The line leaves for the far corner of the blunt ends, a tube's radius long; in between it keeps to the middle.
    middle = np.abs(np.arctan2(nodes[:, 2], nodes[:, 0])) < np.radians(60)
    assert middle.sum() >= 0.6 * len(nodes)
    assert off_centre(nodes[middle]).max() < 0.15 * TUBE
    assert off_centre(nodes).max() < 0.6 * TUBE
    # The straight axis is the mutant: it runs outside the ring.
    assert off_centre(virtual_nodes(*half_ring(), SPACING, "straight")).max() > TUBE


@pytest.mark.parametrize("axis", AXES)
def test_virtual_nodes_are_evenly_spaced_as_asked(axis):
    nodes = virtual_nodes(*half_ring(), SPACING, axis)
    gaps = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
    # A whole number of gaps fits the length; chords of the bent line are a little shorter than its arc.
    assert gaps.mean() == pytest.approx(SPACING, rel=0.1)
    assert gaps.min() > 0.8 * gaps.max()


def test_a_ball_has_its_diameter_as_centre_line():
    points, triangles = icosphere(2)
    nodes = virtual_nodes(points, triangles, 0.01, "centre_line")
    radius = np.linalg.norm(points[0])
    _, singular, _ = np.linalg.svd(nodes - nodes.mean(axis=0))
    # Bands of an icosphere are symmetric: what is left is rounding.
    assert singular[1] < 1e-9 * singular[0]
    assert np.linalg.norm(nodes[-1] - nodes[0]) < 2 * radius
    assert len(nodes) == len(virtual_nodes(points, triangles, 0.01, "straight"))


@pytest.mark.parametrize("axis", AXES)
def test_the_axis_moves_with_the_body(axis):
    points, triangles = half_ring()
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    moved = virtual_nodes(points @ turn.T + 0.2, triangles, SPACING, axis)
    still = virtual_nodes(points, triangles, SPACING, axis) @ turn.T + 0.2
    # A principal direction has no sign: the same nodes, perhaps from the other end.
    assert min(np.abs(moved - still).max(), np.abs(moved[::-1] - still).max()) < 1e-9
