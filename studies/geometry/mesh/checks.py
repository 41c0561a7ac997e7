"""What a mesh must fulfil before a computation. The first fault found raises a StudyError of one sentence."""

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import (
    boundary_triangles,
    connected,
    counted_edges,
    signed_volume,
    tetrahedron_volumes,
    triangle_areas,
    unique_edges,
)
from studies.geometry.mesh.quality import tetrahedron_radius_ratio, triangle_radius_ratio

SLIVER = 1e-4
"""Radius ratio below which the normal of a triangle or the volume of a tetrahedron is unusable."""


def check_surface(points: np.ndarray, triangles: np.ndarray, name: str = "the surface") -> None:
    """Raise StudyError unless points (n, 3) [m] and triangles (t, 3) form closed, outward surfaces without slivers.
    Parts may be separate; intersections are not checked. name: for the message."""
    check_indices(points, triangles, 3, name)
    check_edges(triangles, name)
    check_volume(points, triangles, name)
    areas = triangle_areas(points, triangles)
    ratio = triangle_radius_ratio(points, triangles)
    worst = int(ratio.argmin())
    if ratio[worst] < SLIVER:
        raise StudyError(
            f"{name}: triangle {worst} is degenerate (area {areas[worst]:.3g} m², radius ratio {ratio[worst]:.2g} "
            f"under {SLIVER:g}); remesh the surface"
        )


def check_indices(points: np.ndarray, cells: np.ndarray, corners: int, name: str) -> None:
    """Raise StudyError unless points (n, 3) are finite and all used, and cells (k, corners) use existing points, each
    once."""
    kind = "triangle" if corners == 3 else "tetrahedron"
    if points.ndim != 2 or points.shape[1] != 3:
        raise StudyError(f"{name}: points have shape {points.shape}, expected (n, 3)")
    check_finite(points, name)
    if cells.ndim != 2 or cells.shape[1] != corners or not len(cells):
        raise StudyError(f"{name}: no {kind} found (shape {cells.shape}, expected (k, {corners}) with k > 0)")
    if cells.min() < 0 or cells.max() >= len(points):
        raise StudyError(f"{name}: a {kind} uses point {cells.max()}, but there are only {len(points)} points")
    rows = np.sort(cells, axis=1)
    repeated = np.flatnonzero((rows[:, 1:] == rows[:, :-1]).any(axis=1))
    if len(repeated):
        raise StudyError(f"{name}: {kind} {repeated[0]} uses one point twice and is degenerate; remove it")
    _, first, counts = np.unique(rows, axis=0, return_index=True, return_counts=True)
    if (counts > 1).any():
        twice = int(first[counts > 1].min())
        raise StudyError(
            f"{name}: {int((counts > 1).sum())} faces are duplicated, the first is {kind} {twice}; keep one of each"
        )
    unused = len(points) - len(np.unique(cells))
    if unused:
        raise StudyError(f"{name}: {unused} points belong to no {kind} and would have no mass; remove them")


def check_finite(points: np.ndarray, name: str) -> None:
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise StudyError(
            f"{name}: {len(bad)} points are not finite, the first is number {bad[0]}; repair or remove them"
        )


def check_edges(triangles: np.ndarray, name: str) -> None:
    """Raise StudyError unless triangles (t, 3) are a closed, oriented manifold: two triangles along every edge, in
    opposite directions, and one fan of triangles at every node."""
    half = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    counts = counted_edges(triangles)[1]
    if (counts == 1).any():
        raise StudyError(
            f"{name}: the surface is open, {int((counts == 1).sum())} edges have one triangle only; close the holes"
        )
    if (counts > 2).any():
        raise StudyError(
            f"{name}: the surface is not manifold, {int((counts > 2).sum())} edges have over two triangles; remesh it"
        )
    if len(np.unique(half, axis=0)) != len(half):
        raise StudyError(
            f"{name}: neighbouring triangles are turned in opposite directions; orient the surface consistently"
        )
    pinched = pinched_nodes(triangles)
    if len(pinched):
        raise StudyError(f"{name}: the surface is not manifold, it is pinched at point {pinched[0]}; split that point")


def pinched_nodes(triangles: np.ndarray) -> np.ndarray:
    """Nodes whose triangles form more than one closed fan, for closed, oriented triangles (t, 3).

    Each corner (triangle, node) is linked to the corner of the neighbour across the edge that leaves the node. These
    links form a cycle per fan, so the number of cycles at a node is its number of fans.
    """
    count = len(triangles)
    key = triangles.ravel()
    start, end = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    size = int(triangles.max()) + 1
    order = np.argsort(start * size + end)
    # The half edge end -> start of the neighbour; the half edge after it leaves `start` again.
    opposite = order[np.searchsorted((start * size + end)[order], end * size + start)]
    following = (opposite // 3) * 3 + (opposite % 3 + 1) % 3
    label = np.arange(3 * count)
    while True:
        smaller = np.minimum(label, label[following])
        smaller = np.minimum(smaller, smaller[smaller])
        if (smaller == label).all():
            break
        label = smaller
    fans = np.unique(np.stack([key, label], axis=1), axis=0)[:, 0]
    nodes, counts = np.unique(fans, return_counts=True)
    return nodes[counts > 1]


def check_one_part(triangles: np.ndarray, name: str) -> None:
    parts = int(connected(unique_edges(triangles), int(triangles.max()) + 1).max()) + 1
    if parts > 1:
        raise StudyError(f"{name}: the surface has {parts} separate parts; keep one of them")


def check_volume(points: np.ndarray, triangles: np.ndarray, name: str) -> None:
    volume = signed_volume(points, triangles)
    scale = triangle_areas(points, triangles).sum() ** 1.5
    # A sphere has a volume of 0.094 of this scale; of flat surfaces rounding leaves about 1e-17.
    if abs(volume) <= 1e-9 * scale:
        raise StudyError(f"{name}: the enclosed volume is zero ({volume:.2g} m³); a body needs a thickness")
    if volume < 0:
        raise StudyError(f"{name}: the surface is inverted (volume {volume:.4g} m³); flip its triangles")


def check_tetrahedra(points: np.ndarray, tetrahedra: np.ndarray, name: str = "the mesh") -> None:
    """Raise StudyError unless points (n, 3) [m], all used, and tetrahedra (k, 4), none inverted or a sliver, form a
    body whose boundary is a closed manifold. name: for the message."""
    check_indices(points, tetrahedra, 4, name)
    volumes = tetrahedron_volumes(points, tetrahedra)
    negative = np.flatnonzero(volumes < 0)
    if len(negative):
        raise StudyError(
            f"{name}: {len(negative)} tetrahedra have a negative volume, the first is number {negative[0]} "
            f"({volumes[negative[0]]:.3g} m³); swap two of its points or mesh again"
        )
    ratio = tetrahedron_radius_ratio(points, tetrahedra)
    worst = int(ratio.argmin())
    if ratio[worst] < SLIVER:
        raise StudyError(
            f"{name}: tetrahedron {worst} is a sliver without volume "
            f"(radius ratio {ratio[worst]:.2g} under {SLIVER:g}); mesh again"
        )
    check_edges(boundary_triangles(tetrahedra), name)
