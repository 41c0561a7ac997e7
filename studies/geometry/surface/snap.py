"""Attachments with the same outline on every mesh: nodes near the curve f = g = 0 are moved onto it.

Without this a staircase of edges bounds a held patch, and the force on it differed by 15 % between meshes.
"""

from collections.abc import Sequence

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import triangle_normals, unique_edges
from studies.geometry.mesh.quality import triangle_radius_ratio
from studies.geometry.shape.levelset import Level, Shape, project
from studies.geometry.shape.regions import ON_CURVE, Region
from studies.geometry.surface.first_surface import neighbour_mean
from studies.geometry.surface.node_count import flip_edges

FLOORS = (0.35, 0.2, 0.1, 0.05)
"""Smallest radius ratio of a triangle that a move may leave, in successive rounds: good moves come first."""
POOR = 0.4
"""Radius ratio of a triangle below which its edges are flipped to improve it."""


def outlined(
    shape: Shape, points: np.ndarray, triangles: np.ndarray, regions: Sequence[Region], near: float = np.inf
) -> tuple[np.ndarray, np.ndarray]:
    """The surface with the outline of every region on its edges. Nodes of earlier outlines stay in place, and so do
    nodes with |level| over `near` [m]. Raises StudyError if an outline does not fit."""
    fixed = np.zeros(len(points), bool)
    for region in regions:
        far = np.abs(region.level(points)) > near
        points, triangles, on_curve = snap_region(shape, points, triangles, region, fixed | far)
        fixed |= on_curve
    return points, triangles


def snap_region(
    shape: Shape, points: np.ndarray, triangles: np.ndarray, region: Region, fixed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Moves the nearer end of each edge that crosses level = 0 along the surface onto the curve: points, triangles, and
    the mask (n,) of nodes on the curve.

    points (n, 3) [m] on f = 0; fixed (n,) bool: nodes that stay. An edge of which neither end can move is flipped in
    its quadrilateral. Raises StudyError if edges still cross at the end, because the mesh is too coarse for the region.
    """
    tolerance = ON_CURVE * shape.size
    for floor in FLOORS:
        for pick in range(4):
            crossing = crossing_edges(region, points, unique_edges(triangles), tolerance)
            if not len(crossing):
                break
            chosen = choose_ends(points, crossing, region.level(points), fixed, other=pick % 2 == 1)
            moved = points.copy()
            if len(chosen):
                moved[chosen] = project(shape, points[chosen], (region.level,))
            points = without_spoilers(points, moved, triangles, floor)
        triangles = turn_edges(points, triangles, region, fixed, tolerance, floor)
        on_curve = np.abs(region.level(points)) <= tolerance
        points = relax(shape, points, triangles, region, on_curve, fixed)
    left = len(crossing_edges(region, points, unique_edges(triangles), tolerance))
    if left:
        raise StudyError(
            f"{shape.name}: {left} edges still cross the outline of {region}; use more nodes or a larger region"
        )
    return points, triangles, np.abs(region.level(points)) <= tolerance


def turn_edges(
    points: np.ndarray, triangles: np.ndarray, region: Region, fixed: np.ndarray, tolerance: float, floor: float
) -> np.ndarray:
    """The triangles after flips of edges that cross the curve of `region`, then of edges of poor triangles; no flip
    makes one that crosses it."""
    level = region.level(points)
    side = np.sign(np.where(np.abs(level) <= tolerance, 0.0, level))
    crossing = crossing_edges(region, points, unique_edges(triangles), tolerance)
    poor = unique_edges(triangles[triangle_radius_ratio(points, triangles) < POOR])
    for edges, least in ((crossing, floor), (poor, 1.0)):
        # An edge between two fixed nodes may be part of another region's outline.
        edges = edges[~fixed[edges].all(axis=1)]
        triangles = flip_edges(points, triangles, edges, lambda k, m: side[k] * side[m] >= 0, least)
    return triangles


def crossing_edges(region: Region, points: np.ndarray, edges: np.ndarray, tolerance: float) -> np.ndarray:
    """Those of the edges (e, 2) whose ends lie strictly on different sides of the curve, shape (c, 2)."""
    level = region.level(points)
    side = np.sign(np.where(np.abs(level) <= tolerance, 0.0, level))
    return edges[side[edges[:, 0]] * side[edges[:, 1]] < 0]


def choose_ends(
    points: np.ndarray, crossing: np.ndarray, level: np.ndarray, fixed: np.ndarray, other: bool
) -> np.ndarray:
    """For each crossing edge (c, 2) the end nearer to the curve, or the `other` one, unless it is fixed; each once."""
    first_nearer = np.abs(level[crossing[:, 0]]) <= np.abs(level[crossing[:, 1]])
    column = np.where(first_nearer != other, 0, 1)
    chosen = np.unique(crossing[np.arange(len(crossing)), column])
    return chosen[~fixed[chosen]]


def without_spoilers(before: np.ndarray, after: np.ndarray, triangles: np.ndarray, floor: float) -> np.ndarray:
    """`after` with the node of each bad triangle that moved farthest put back, until none is bad: with a radius ratio
    below both `floor` and its former value, or with a normal that turns by more than 60 degrees."""
    limit = np.minimum(floor, triangle_radius_ratio(before, triangles) - 1e-12)
    old_normals = triangle_normals(before, triangles)
    after = after.copy()
    while True:
        normals = triangle_normals(after, triangles)
        cosine = np.einsum("ij,ij->i", normals, old_normals)
        turned = cosine < 0.5 * np.linalg.norm(normals, axis=1) * np.linalg.norm(old_normals, axis=1)
        distance = np.linalg.norm(after - before, axis=1)
        bad = ((triangle_radius_ratio(after, triangles) < limit) | turned) & (distance[triangles].max(axis=1) > 0)
        if not bad.any():
            return after
        corners = triangles[bad]
        back = corners[np.arange(len(corners)), distance[corners].argmax(axis=1)]
        after[back] = before[back]


def relax(
    shape: Shape,
    points: np.ndarray,
    triangles: np.ndarray,
    region: Region | None,
    on_curve: np.ndarray,
    fixed: np.ndarray,
    rounds: int = 4,
) -> np.ndarray:
    """Points (n, 3) [m] after `rounds` of relaxation: each node moves half way to the mean of its neighbours and is
    projected back onto f = 0; nodes on the curve of `region` stay on it.

    on_curve, fixed (n,) bool; fixed nodes stay. Moves that make a triangle worse than before and than a radius ratio of
    0.6 are taken back. Nodes do not change sides of the region.
    """
    edges = unique_edges(triangles)
    curve = edges[on_curve[edges].all(axis=1)]
    constraint: tuple[Level, ...] = () if region is None else (region.level,)
    tolerance = ON_CURVE * shape.size
    for _ in range(rounds):
        moved = points.copy()
        free = ~on_curve & ~fixed
        along = on_curve & ~fixed
        moved[free] = project(shape, (0.5 * (points + neighbour_mean(points, edges)))[free])
        if along.any():
            moved[along] = project(shape, (0.5 * (points + neighbour_mean(points, curve)))[along], constraint)
        if region is not None:
            before, after = region.level(points), region.level(moved)
            crossed = free & ((before * after <= 0) | (np.abs(after) <= tolerance))
            moved[crossed] = points[crossed]
        points = without_spoilers(points, moved, triangles, floor=0.6)
    return points
