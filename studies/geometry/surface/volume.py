"""Gives a surface mesh exactly the volume of its shape by moving its nodes slightly along the normals.

A polyhedron whose nodes lie on a round surface is too small, by 1 to 3 % at 550 nodes. Nodes move outward where the
triangles around them cut off the shape, and inward where they bridge a hollow, so nodes remain as near to the shape as
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
"""Relative deviation of the volume at which the search ends, and the largest that is accepted: a tenth of what is
promised."""
ROUNDS = 12
FARTHEST = 0.25
"""Largest motion of a node, over the mean edge around it."""
WORST = 0.15
"""Radius ratio below which the motion may not bring a triangle, unless the triangle was worse before."""
Keeper = Callable[[np.ndarray], np.ndarray]
"""Moved points (n, 3) -> their allowed positions."""


def with_volume(
    points: np.ndarray, triangles: np.ndarray, volume: float, level: Level, regions: Sequence[Region] = ()
) -> np.ndarray:
    """Points (n, 3) [m] of the closed outward surface `triangles` (t, 3) moved until it encloses `volume` [m^3].

    level: the shape, a distance [m] near its surface, on which the points lie. Each node goes along its normal by the
    mean depth of the shape above the triangles around it, and all by one more length, which is sought. Nodes on the
    outline of a region stay on it, and none changes sides. Raises StudyError when no small move has that volume.
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
    """The points moved until the volume is met as well as it can be, those of `still` (n,) not at all."""
    normals, most = vertex_normals(points, triangles), FARTHEST * mean_edges(points, triangles)
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
    """Nodes (n,) bool of triangles that the move makes poor, turns over, or lets cross others."""
    old, new = triangle_radius_ratio(before, triangles), triangle_radius_ratio(after, triangles)
    one, other = triangle_normals(before, triangles), triangle_normals(after, triangles)
    bad = (new < np.minimum(old, WORST) - 1e-9) | (np.einsum("ij,ij->i", one, other) <= 0)
    rows = np.concatenate([np.flatnonzero(bad), crossing_triangles(after, triangles).ravel()])
    nodes = np.zeros(len(before), bool)
    nodes[triangles[rows]] = True
    return nodes


def depth(points: np.ndarray, triangles: np.ndarray, level: Level) -> np.ndarray:
    """Mean depth [m] of the shape's surface above the triangles around each node, (n,), weighted by their areas.

    Of a triangle it is the mean over the middles of its edges: exact where the depth is quadratic.
    """
    corners = points[triangles]
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
    above = -level(middles.reshape(-1, 3)).reshape(-1, 3).mean(axis=1)
    areas = triangle_areas(points, triangles)
    weights = np.bincount(triangles.ravel(), np.repeat(areas, 3), len(points))
    return np.bincount(triangles.ravel(), np.repeat(areas * above, 3), len(points)) / np.maximum(weights, 1e-300)


def mean_edges(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Mean length [m] of the edges at each node, (n,)."""
    edges = unique_edges(triangles)
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    count = np.bincount(edges.ravel(), minlength=len(points))
    return np.bincount(edges.ravel(), np.repeat(lengths, 2), len(points)) / np.maximum(count, 1)


def outline_keeper(points: np.ndarray, regions: Sequence[Region]) -> Keeper:
    """A function that moves nodes of an outline back onto it, and others back to their side of it."""
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
