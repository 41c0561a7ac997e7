"""The facets of a surface mesh: flat, or quadratic with mid-side nodes on the true surface."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from studies.geometry.mesh.organ_mesh import counted_edges, triangle_areas, unique_edges
from studies.geometry.shape.levelset import Shape, project
from studies.geometry.shape.regions import Region

PARTS = 4
"""Parts of each side of a facet for measuring distances: 15 points per facet."""
OUTLINE = 1e-9
"""Level [m] within which a node is on an outline: far above rounding and far below an edge."""


def region_side(region: Region, points: np.ndarray) -> np.ndarray:
    """Side (n,) of points (n, 3) [m]: -1 inside the region, 1 outside, 0 on its outline."""
    level = region.level(points)
    return np.sign(np.where(np.abs(level) <= OUTLINE, 0.0, level))


def region_area(region: Region, points: np.ndarray, triangles: np.ndarray) -> float:
    """Area [m²] inside the region of a surface of points (n, 3) [m] and triangles (t, 3), on each of which the level of
    the region is interpolated linearly."""
    level = np.sort(region.level(points)[triangles], axis=1)
    low, middle, high = level.T
    with np.errstate(invalid="ignore", divide="ignore"):
        # A corner that is alone on its side cuts off a triangle, with a share of both edges at that corner.
        below = low**2 / ((middle - low) * (high - low))
        above = high**2 / ((high - low) * (high - middle))
    share = np.where(high <= 0, 1.0, np.where(low >= 0, 0.0, np.where(middle >= 0, below, 1.0 - above)))
    return float((triangle_areas(points, triangles) * share).sum())


def outline_edges(points: np.ndarray, triangles: np.ndarray, region: Region) -> np.ndarray:
    """Edges (e, 2), lower index first, between one of the triangles (t, 3) inside the region and one outside."""
    inside = (region_side(region, points) <= 0)[triangles].all(axis=1)
    edges, count = counted_edges(triangles[inside])
    return edges[count == 1]


def places_on(
    shape: Shape, points: np.ndarray, edges: np.ndarray, outlines: np.ndarray, regions: Sequence[Region]
) -> np.ndarray:
    """The middles (e, 3) [m] of edges (e, 2), projected onto f = 0; those of `outlines` (o, 2) stay on the curve."""
    middles = points[edges].mean(axis=1)
    on = np.zeros(len(edges), bool)
    if len(outlines):
        on = (edges[:, None] == outlines[None]).all(axis=2).any(axis=1)
    middles[~on] = project(shape, middles[~on])
    for k in np.flatnonzero(on):
        at = [r for r in regions if (region_side(r, points[edges[k]]) == 0).all()][:1]
        middles[k] = project(shape, middles[k : k + 1], tuple(r.level for r in at))[0]
    return middles


def with_middles(
    shape: Shape, points: np.ndarray, triangles: np.ndarray, regions: Sequence[Region], curved: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Points and the mid-side nodes of all edges (m, 3) [m], and facets (t, 6): corners, then the nodes between first
    and second, second and third, third and first. curved: whether these are projected onto f = 0 and the outlines of
    `regions`."""
    edges, count = unique_edges(triangles), len(points)
    middles = points[edges].mean(axis=1)
    if curved:
        middles = project(shape, middles)
        for region in regions:
            rim = outline_edges(points, triangles, region)
            here = np.searchsorted(edges @ [count, 1], rim @ [count, 1])
            middles[here] = project(shape, middles[here], (region.level,))
    pairs = [np.sort(triangles[:, pair], axis=1) @ [count, 1] for pair in ([0, 1], [1, 2], [2, 0])]
    return np.vstack([points, middles]), np.column_stack(
        [triangles, *(count + np.searchsorted(edges @ [count, 1], pair) for pair in pairs)]
    )


def along_facets(points: np.ndarray, facets: np.ndarray, parts: int = PARTS) -> tuple[np.ndarray, np.ndarray]:
    """Evenly spread points (m, 3) [m] on flat facets (t, 3) or quadratic ones (t, 6), with sides divided into `parts`,
    and the flat triangles (parts² t, 3) between them."""
    local, pieces = lattice(parts)
    places = np.einsum("pa,fai->fpi", shape_functions(local, facets.shape[1] == 6), points[facets])
    first = len(local) * np.arange(len(facets))
    return places.reshape(-1, 3), (pieces + first[:, None, None]).reshape(-1, 3)


@cache
def lattice(parts: int = PARTS) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric coordinates (p, 3) of a regular lattice on a triangle, and the triangles (parts², 3) between them."""
    rows = [(i, j) for i in range(parts + 1) for j in range(parts + 1 - i)]
    number = {row: k for k, row in enumerate(rows)}
    upright = [(number[i, j], number[i + 1, j], number[i, j + 1]) for i, j in rows if i + j < parts]
    turned = [(number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]) for i, j in rows if i + j < parts - 1]
    return np.array([(parts - i - j, i, j) for i, j in rows]) / parts, np.array(upright + turned)


def shape_functions(local: np.ndarray, curved: bool) -> np.ndarray:
    """Shape functions of a facet at barycentric coordinates (p, 3): linear (p, 3), or quadratic (p, 6), corners
    first."""
    if not curved:
        return local
    return np.concatenate([local * (2.0 * local - 1.0), 4.0 * local * np.roll(local, -1, axis=1)], axis=1)
