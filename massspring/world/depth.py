"""How deep a body lies in a sphere or capsule, and whether the middle of that has been inside the body."""

from itertools import pairwise

import numpy as np

from massspring.body.surface import winding_number
from massspring.kernels.contact.nearest import distance_to_axis, passes_surface, within_into
from massspring.world.obstacles import Capsule, Sphere

Round = Sphere | Capsule


def axis_at(obstacle: Round, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Start of the axis at time `t` and the way to its end [m], (3,) each; of a sphere its centre and 0."""
    span = obstacle.span if isinstance(obstacle, Capsule) else np.zeros(3)
    return obstacle.anchor + obstacle.path(t), span


def facets_within(obstacle: Round, x: np.ndarray, facets: np.ndarray, t: float, margin: float = 0.0) -> np.ndarray:
    """Which facets, flat (f, 3) or curved (f, 6), between `x` (n, 3) come within `margin` [m] of an obstacle at time
    `t` [s], (f,) bool."""
    nodes, near = np.ascontiguousarray(facets, dtype=np.uint32), np.zeros(len(facets), dtype=bool)
    within_into(np.ascontiguousarray(x), nodes, *axis_at(obstacle, t), obstacle.radius + margin, near)
    return near


def deepest(
    obstacle: Round,
    x: np.ndarray,
    facets: np.ndarray,
    triangles: np.ndarray,
    t: float,
    since: tuple[np.ndarray, float] | None = None,
) -> tuple[float, bool]:
    """How deep the deepest point of a body lies in an obstacle at time `t` [m], negative outside, and whether a point
    of the obstacle's axis is inside the body, or passed through it `since` an earlier shape (n, 3) and time [s].

    The depth is the radius less the distance of the axis from the facets, flat (f, 3) or curved (f, 6), between `x`
    (n, 3) [m]; plus it where the axis is inside the closed surface `triangles` (f, 3).
    """
    start, span = axis_at(obstacle, t)
    distance = float(distance_to_axis(x, facets, start, span))
    inside = is_within(start, span, x, triangles)
    depth = obstacle.radius + distance if inside else obstacle.radius - distance
    return depth, inside or (since is not None and _passed(obstacle, since, (x, t), triangles, distance))


def is_within(start: np.ndarray, span: np.ndarray, x: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether a point of the axis lies inside the closed surface."""
    end, corners = start + span, x[triangles]
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    if (np.maximum(start, end) < low).any() or (np.minimum(start, end) > high).any():
        return False
    return abs(winding_number(start, x, triangles)) > 0.5 or bool(passes_surface(start, end, end, x, triangles))


def _passed(
    obstacle: Round,
    before: tuple[np.ndarray, float],
    after: tuple[np.ndarray, float],
    triangles: np.ndarray,
    distance: float,
) -> bool:
    """Whether the way of the axis passes the surface both as it is before and as it is after, each a shape and a time;
    it ends `distance` [m] from the latter.

    Before alone: the obstacle pushes the surface away. After alone: the surface follows one that leaves. Both: it went
    through, or along the surface by more than its radius.
    """
    (_, t0), (_, t1) = before, after
    starts = [axis_at(obstacle, t)[0] for t in (t0, *(t for t in obstacle.path.times if t0 < t < t1), t1)]
    if sum(float(np.linalg.norm(q - p)) for p, q in pairwise(starts)) < distance:
        return False
    span = axis_at(obstacle, t1)[1]
    swept = [part for p, q in pairwise(starts) for part in ((p, p + span, q), (q, q + span, p + span))]
    return all(any(passes_surface(*corners, x, triangles) for corners in swept) for x, _ in (before, after))
