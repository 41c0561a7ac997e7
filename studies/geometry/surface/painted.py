"""A region painted on the nodes of a surface, represented by few samples: the same part of space for every mesh."""

import numpy as np
from scipy.spatial import KDTree

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import mean_edge, triangle_areas
from studies.geometry.shape.regions import PaintedRegion

WIDTH = 0.75
"""Standard deviation of the Gaussian that smooths the border, over the mean edge there; it removes the steps from node
to node."""
SPARSE = 0.4
"""Distance between samples over their distance to the border; below 1/2 the nearest sample is always on the correct
side."""


def painted_region(points: np.ndarray, triangles: np.ndarray, inside: np.ndarray, name: str) -> PaintedRegion:
    """The region of the nodes `inside` (n,) bool of a surface of points (n, 3) [m] and triangles (t, 3), with its
    border half way between nodes inside and outside. Samples are rounded to 1 µm. name: for the message. Raises
    StudyError if all nodes are inside, or all outside."""
    used = np.unique(triangles)
    if len(np.unique(inside[used])) != 2:
        what = "the whole surface" if inside[used].all() else "nothing of the surface"
        raise StudyError(f"{name} holds {what}; paint a part of it, values above 0 where the body is held")
    corners = np.repeat(triangle_areas(points, triangles) / 3.0, 3)
    areas = np.bincount(triangles.ravel(), corners, len(points))[used]
    at_border = inside[triangles].any(axis=1) & ~inside[triangles].all(axis=1)
    x, within = points[used], inside[used]
    rows = np.vstack(
        [
            thinned(x[part], sign * areas[part], KDTree(x[~part]).query(x[part])[0])
            for part, sign in ((within, 1.0), (~within, -1.0))
        ]
    )
    samples = tuple((*(round(c, 6) for c in row[:3]), float(f"{row[3]:.4g}")) for row in rows.tolist())
    return PaintedRegion(samples, WIDTH * mean_edge(points, triangles[at_border]))


def thinned(points: np.ndarray, areas: np.ndarray, away: np.ndarray) -> np.ndarray:
    """Samples x, y, z [m] and area [m²] of points (n, 3), shape (s, 4), as dense as their distance `away` (n,) [m] from
    the other side requires; each has the area of the points that it represents."""
    tree, left, rows = KDTree(points), np.ones(len(points), bool), []
    for i in np.argsort(-away):
        if left[i]:
            near = np.array(tree.query_ball_point(points[i], SPARSE * away[i]))
            near = near[left[near]]
            left[near] = False
            rows.append([*points[i], areas[near].sum()])
    return np.array(rows)
