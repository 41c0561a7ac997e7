"""Meshes a surface with a given number of nodes."""

from collections.abc import Callable

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import Surface, signed_volume, unique_edges
from studies.geometry.mesh.quality import triangle_radius_ratio
from studies.geometry.shape.levelset import Shape, project
from studies.geometry.surface.edit import with_node_count

TOLERANCE = 0.02
"""Largest relative deviation from the node count that edits of single nodes correct (or 5 nodes)."""
CLOSE = 0.005
"""Relative deviation at which the search stops: so few edits do not reduce the quality."""
FEWEST, MOST = 60, 20_000
TRIES = 12
QUALITY = 0.2
"""Smallest radius ratio of a triangle; below it the fill has slivers with any optimiser."""


def surface_with(
    nodes: int, area: float, mesh_at: Callable[[float], Surface], shape: Shape, handles: int = 0
) -> Surface:
    """A good closed surface on f = 0 with exactly `nodes` nodes, or within TOLERANCE or 5 if single edits fail.

    area: of the true surface [m^2]; mesh_at: edge length [m] -> points (n, 3) [m] and triangles (t, 3); handles: number
    that the surface has to have; a ring has one. Raises StudyError for `nodes` outside FEWEST to MOST, and if no try is
    one outward sheet without slivers.
    """
    if not FEWEST <= nodes <= MOST:
        raise StudyError(f"{shape.name}: {nodes} surface nodes asked for, but the mesher offers {FEWEST} to {MOST}")
    size = 1.06 * np.sqrt(2.0 * area / (np.sqrt(3.0) * nodes))
    candidates: list[tuple[float, Surface]] = []
    for attempt in range(TRIES):
        points, triangles = mesh_at(size)
        miss = abs(len(points) / nodes - 1.0)
        if miss <= max(TOLERANCE, 5.0 / nodes):
            edited, triangles = with_node_count(points, triangles, nodes)
            surface = project(shape, edited), triangles
            if is_good(*surface, handles):
                candidates.append((miss, surface))
                if miss <= CLOSE and len(edited) == nodes:
                    break
        # N ~ size^-2; a small alternating overshoot keeps the search from repeating one bad mesh.
        size *= (len(points) / nodes) ** 0.5 * (1.0 + 0.005 * (-1) ** attempt * (attempt // 2))
    if not candidates:
        raise StudyError(
            f"{shape.name}: no well-shaped surface with {nodes} nodes in {TRIES} tries; "
            "ask for more nodes, or for a smoother shape"
        )
    return min(candidates, key=lambda item: (len(item[1][0]) != nodes, item[0]))[1]


def is_good(points: np.ndarray, triangles: np.ndarray, handles: int = 0) -> bool:
    """Whether a closed surface is outward and has so many handles and no slivers."""
    if handles_of(points, triangles) != handles or signed_volume(points, triangles) <= 0:
        return False
    return bool(triangle_radius_ratio(points, triangles).min() > QUALITY)


def handles_of(points: np.ndarray, triangles: np.ndarray) -> int:
    """Number of handles of a connected closed surface of points (n, 3), all used: 1 - (V - E + F) / 2."""
    return 1 - (len(points) - len(unique_edges(triangles)) + len(triangles)) // 2
