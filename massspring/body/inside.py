"""Whether a point lies inside a closed surface, and its distance from the surface."""

import numpy as np

from massspring.body.body import Body
from massspring.body.springs import EDGES_OF_TRIANGLE, lengths, unique_edges
from massspring.body.surface import winding_number
from massspring.kernels.probe.continuous import Pair
from massspring.kernels.probe.point_query import distance_to


def mean_edge(body: Body) -> float:
    """Mean edge length of the surface at rest [m]."""
    return float(lengths(body.rest, unique_edges(body.triangles, EDGES_OF_TRIANGLE)).mean())


def new_pair() -> Pair:
    """Scratch for one point and one triangle; every call overwrites it."""
    return Pair(np.zeros((2, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), np.zeros(3))


def surface_distance(point: np.ndarray, x: np.ndarray, triangles: np.ndarray) -> float:
    """Distance of a point (3,) to a surface [m]."""
    return float(distance_to(point, x, triangles, np.zeros((3, 3)), np.zeros(3)))


def is_inside(point: np.ndarray, x: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether the closed surface encloses the point (3,)."""
    return abs(winding_number(point, x, triangles)) > 0.5
