"""Gives a surface mesh the volume of its shape by moving its nodes slightly along the normals.

A polyhedron whose nodes lie on a round surface is too small, by 1 to 3 % at 550 nodes. Nodes move outward where the
triangles around them lie inside the shape, and inward where they bridge a hollow, so nodes are as near to the shape as
the triangles.
"""

from collections.abc import Callable, Sequence

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import (
    signed_volume,
    triangle_areas,
    triangle_normals,
    unique_edges,
    vertex_normals,
)
from studies.geometry.mesh.quality import triangle_radius_ratio
from studies.geometry.shape.levelset import Level, gradient
from studies.geometry.shape.regions import ON_CURVE, Region
from studies.geometry.surface.intersections import crossing_triangles

EXACT, ENOUGH = 1e-6, 1e-4
"""Relative deviation of the volume at which the search ends, and the largest that is accepted: a tenth of the promised
one."""
ROUNDS = 12
FARTHEST = 0.25
"""Largest move of a node, over the mean edge at it."""
WORST = 0.15
"""Smallest radius ratio of a triangle after the move, unless it was worse before."""
Keeper = Callable[[np.ndarray], np.ndarray]
"""Moved points (n, 3) [m] -> their allowed positions (n, 3) [m]."""


def with_volume(
    points: np.ndarray, triangles: np.ndarray, volume: float, level: Level, regions: Sequence[Region] = ()
) -> np.ndarray:
    """Points (n, 3) [m] of a closed outward surface, moved so that its triangles (t, 3) enclose `volume` [m^3].

    level: of the shape, a distance [m] near its surface, on which the points lie. Each node moves along its normal by
    the mean depth of the triangles around it, plus one length for all nodes that gives the volume. Nodes on the outline
    of a region stay on it, and no node changes sides. Raises StudyError if no small move gives the volume to ENOUGH
    without intersections.
    """
    keep, still = outline_keeper(points, regions), np.zeros(len(points), bool)
    for _ in range(ROUNDS):
        after = moved_to(points, triangles, volume, level, keep, still)
        spoilt = spoilt_nodes(points, after, triangles)
        if not (spoilt & ~still).any():
            break
        still |= spoilt
    off = signed_volume(after, triangles) / volume - 1.0
    if abs(off) > ENOUGH or len(crossing_triangles(after, triangles)):
        raise StudyError(
            f"its nodes cannot be moved so that the mesh has the shape's volume "
            f"({100 * off:+.2g} % difference remains); use more nodes, or a smoother shape"
        )
    return after


def moved_to(
    points: np.ndarray, triangles: np.ndarray, volume: float, level: Level, keep: Keeper, still: np.ndarray
) -> np.ndarray:
    """The points moved so that the volume is met as well as possible; those of `still` (n,) bool do not move."""
    edges, normals = unique_edges(triangles), vertex_normals(points, triangles)
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    total, count = (np.bincount(edges.ravel(), weights, len(points)) for weights in (np.repeat(lengths, 2), None))
    most = FARTHEST * (total / np.maximum(count, 1))
    sagging, most = depth(points, triangles, level), np.where(still, 0.0, most)
    area, further = float(triangle_areas(points, triangles).sum()), 0.0
    for _ in range(ROUNDS):
        after = keep(points + np.clip(sagging + further, -most, most)[:, None] * normals)
        missing = volume - signed_volume(after, triangles)
        if abs(missing) <= EXACT * volume:
            break
        further += missing / area
    return after


def spoilt_nodes(before: np.ndarray, after: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Nodes (n,) bool of triangles that the move makes poor, inverts, or makes cross others."""
    old, new = triangle_radius_ratio(before, triangles), triangle_radius_ratio(after, triangles)
    one, other = triangle_normals(before, triangles), triangle_normals(after, triangles)
    bad = (new < np.minimum(old, WORST) - 1e-9) | (np.einsum("ij,ij->i", one, other) <= 0)
    rows = np.concatenate([np.flatnonzero(bad), crossing_triangles(after, triangles).ravel()])
    nodes = np.zeros(len(before), bool)
    nodes[triangles[rows]] = True
    return nodes


def depth(points: np.ndarray, triangles: np.ndarray, level: Level) -> np.ndarray:
    """Mean depth [m] of the triangles around each node below the surface of the shape, (n,), weighted by area; that of
    a triangle is the mean over the middles of its edges, exact for a quadratic depth."""
    corners = points[triangles]
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
    above = -level(middles.reshape(-1, 3)).reshape(-1, 3).mean(axis=1)
    areas = triangle_areas(points, triangles)
    weights = np.bincount(triangles.ravel(), np.repeat(areas, 3), len(points))
    return np.bincount(triangles.ravel(), np.repeat(areas * above, 3), len(points)) / np.maximum(weights, 1e-300)


def outline_keeper(points: np.ndarray, regions: Sequence[Region]) -> Keeper:
    """A function that moves nodes of an outline back onto it, and puts others back if they change sides of it."""
    reach = 10 * ON_CURVE * float(np.linalg.norm(np.ptp(points, axis=0)))
    before = [region.level(points) for region in regions]

    def keep(moved: np.ndarray) -> np.ndarray:
        moved = moved.copy()
        for region, level in zip(regions, before, strict=True):
            on_curve = np.abs(level) <= reach
            for _ in range(4):
                x = moved[on_curve]
                slope = gradient(region.level, x, 1e3 * reach)
                square = np.maximum((slope * slope).sum(axis=1), 1e-300)
                moved[on_curve] = x - (region.level(x) / square)[:, None] * slope
            after = region.level(moved)
            crossed = ~on_curve & ((after * level <= 0) | (np.abs(after) <= reach))
            moved[crossed] = points[crossed]
        return moved

    return keep
