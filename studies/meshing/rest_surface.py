"""The surface of a body at rest, with flat or curved facets, and the nearest points on it."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from massspring.body.quadratic import PARTS_OF_FACET
from studies.geometry.mesh.organ_mesh import connected, triangle_areas
from studies.geometry.surface.distance import distance_to_surface
from studies.geometry.surface.sides import along_facets, lattice, shape_functions

DIVISIONS = 6
"""Divisions of the sides of a facet for sampling: 28 points and 36 triangles per facet."""
CANDIDATES = 12
"""Number of triangles, by distance of their centroids, that are tried first for a point."""
BLOCK = 4_000
"""Points searched at once, so that the memory stays below 100 MB."""
ROUNDING = 1e-9
"""Difference, over the size of the surface, allowed between two computations of a distance."""
VOLUME_ORDER = 4
"""Degree of the polynomial x · (x_s × x_t) of a quadratic facet."""
OUTER, LUMEN = "outer", "lumen"


class Nearest(NamedTuple):
    """The points of a surface nearest to q given points."""

    distance: np.ndarray
    """Distances, (q,) [m]."""
    facet: np.ndarray
    """Facets of the nearest points, (q,)."""
    local: np.ndarray
    """Barycentric coordinates in the facet, (q, 3)."""


@dataclass(frozen=True, eq=False)
class RestSurface:
    """A closed surface of flat or curved facets."""

    points: np.ndarray
    """Rest positions [m], (n, 3)."""
    facets: np.ndarray
    """Nodes of each facet, outward from the tissue: (f, 3) corners, or (f, 6) with the nodes between first and second,
    second and third, third and first."""

    @property
    def curved(self) -> bool:
        return self.facets.shape[1] == 6

    def lattice(self, divisions: int = DIVISIONS) -> tuple[np.ndarray, np.ndarray]:
        """Points (m, 3) [m] on all facets and the triangles (t, 3) between them, `divisions`² a facet."""
        return along_facets(self.points, self.facets, divisions)

    @property
    def areas(self) -> np.ndarray:
        """Share of each node in the area of the flat triangles between the nodes [m²], (n,)."""
        flat = self.facets[:, PARTS_OF_FACET].reshape(-1, 3) if self.curved else self.facets
        return np.bincount(flat.ravel(), np.repeat(triangle_areas(self.points, flat) / 3.0, 3), len(self.points))

    @cached_property
    def volume(self) -> float:
        """Volume [m³] that it encloses, exact for curved facets; negative for a lumen, whose facets are oriented into
        it."""
        local, weights = get_quadrature(RefTri, VOLUME_ORDER)
        centred = (self.points - self.points[self.facets].mean(axis=(0, 1)))[self.facets]
        barycentric = np.column_stack([1.0 - local.sum(axis=0), *local])
        x = np.einsum("qa,fai->fqi", shape_functions(barycentric, self.curved), centred)
        along = np.einsum("dqa,fai->dfqi", _slopes(barycentric, self.curved), centred)
        return float(np.einsum("fqi,fqi,q->", x, np.cross(*along), weights) / 3.0)

    def nearest(self, queries: np.ndarray) -> Nearest:
        """The nearest point of the surface to each of `queries` (q, 3) [m]."""
        divisions = DIVISIONS if self.curved else 1
        places, triangles = self.lattice(divisions)
        corners, distance = places[triangles], distance_to_surface(queries, places, triangles)
        tree = KDTree(corners.mean(axis=1))
        blocks = np.array_split(np.arange(len(queries)), max(1, -(-len(queries) // BLOCK)))
        each = [_nearest(queries[block], corners, tree, distance[block]) for block in blocks]
        triangle, inside = (np.concatenate(part) for part in zip(*each, strict=True))
        facet, part = np.divmod(triangle, divisions**2)
        local, parts = lattice(divisions)
        return Nearest(distance, facet, np.einsum("qc,qci->qi", inside, local[parts[part]]))

    def interpolated(self, values: np.ndarray, at: Nearest) -> np.ndarray:
        """Nodal values (n, 3) at points of the surface, (q, 3)."""
        return np.einsum("qa,qai->qi", shape_functions(at.local, self.curved), values[self.facets[at.facet]])


def rest_surfaces(points: np.ndarray, facets: np.ndarray) -> dict[str, RestSurface]:
    """The boundary `facets` (f, 3 or 6) on points (n, 3) [m] as an outer surface and, in a hollow body, a lumen: the
    connected parts that enclose a positive and a negative volume."""
    ends = facets[:, [[0, 1], [1, 2]]].reshape(-1, 2).astype(np.int64)
    label = connected(ends, len(points))[facets[:, 0]]
    parts = [facets[label == number] for number in np.unique(label)]
    inside = [RestSurface(points, part).volume < 0.0 for part in parts]
    sides = {OUTER: [part for part, lumen in zip(parts, inside, strict=True) if not lumen]}
    sides[LUMEN] = [part for part, lumen in zip(parts, inside, strict=True) if lumen]
    return {name: RestSurface(points, np.concatenate(side)) for name, side in sides.items() if side}


def six_node_facets(triangles: np.ndarray) -> np.ndarray | None:
    """The facets (f, 6) whose four flat parts are the `triangles` (4 f, 3) of a quadratic body; None if they are not
    such parts."""
    if len(triangles) % 4:
        return None
    parts = triangles.reshape(-1, 4, 3)
    facets = np.empty((len(parts), 6), triangles.dtype)
    for part, corner in np.ndindex(4, 3):
        facets[:, PARTS_OF_FACET[part, corner]] = parts[:, part, corner]
    return facets if np.array_equal(facets[:, PARTS_OF_FACET], parts) else None


def _slopes(local: np.ndarray, curved: bool) -> np.ndarray:
    """Their derivatives along the second and the third barycentric coordinate, (2, p, 3 or 6)."""
    directions = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])[:, None]
    if not curved:
        return np.broadcast_to(directions, (2, *local.shape))
    ahead = np.roll(local, -1, axis=1)
    middles = 4.0 * (directions * ahead + local * np.roll(directions, -1, axis=2))
    return np.concatenate([directions * (4.0 * local - 1.0), middles], axis=2)


def _nearest(
    queries: np.ndarray, corners: np.ndarray, tree: KDTree, distance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """For each of `queries` (q, 3) the triangle of `corners` (t, 3, 3) at the `distance` (q,) [m], and the barycentric
    coordinates in it (q, 3); `tree`: of the centroids."""
    triangle, inside = np.empty(len(queries), np.int64), np.empty((len(queries), 3))
    pending, count = np.arange(len(queries)), min(CANDIDATES, len(corners))
    allowed = ROUNDING * float(np.ptp(corners[:, 0], axis=0).max())
    while len(pending):
        near = tree.query(queries[pending], k=count)[1].reshape(len(pending), -1)
        square, local = _feet(queries[pending][:, None], corners[near])
        best, row = square.argmin(axis=1), np.arange(len(pending))
        triangle[pending], inside[pending] = near[row, best], local[row, best]
        if count == len(corners):
            break
        pending = pending[np.sqrt(square[row, best]) > distance[pending] + allowed]
        count = min(2 * count, len(corners))
    return triangle, inside


def _feet(queries: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squared distances (q, k) [m²] of points (q, 1, 3) to triangles (q, k, 3, 3), and the nearest points as
    barycentric coordinates (q, k, 3): the foot in the plane if it is inside, else that on the nearest side."""
    u, v = corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0]
    w = queries - corners[:, :, 0]
    uu, uv, vv, wu, wv = (np.einsum("qki,qki->qk", *pair) for pair in ((u, u), (u, v), (v, v), (w, u), (w, v)))
    area = uu * vv - uv * uv
    flat = area <= 1e-20 * uu * vv
    area = np.where(flat, 1.0, area)
    s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    face = np.stack([1.0 - s - t, s, t], axis=2)
    options = [np.where((face.min(axis=2) >= 0.0)[:, :, None] & ~flat[:, :, None], face, np.nan)]
    for k in range(3):
        start, side = corners[:, :, k], corners[:, :, (k + 1) % 3] - corners[:, :, k]
        length = np.maximum(np.einsum("qki,qki->qk", side, side), 1e-300)
        along = np.clip(np.einsum("qki,qki->qk", queries - start, side) / length, 0.0, 1.0)
        options.append(np.zeros_like(face))
        options[-1][:, :, k], options[-1][:, :, (k + 1) % 3] = 1.0 - along, along
    places = np.stack(options)
    gaps = np.einsum("oqkc,qkci->oqki", places, corners) - queries
    squares = np.einsum("oqki,oqki->oqk", gaps, gaps)
    best = np.nanargmin(squares, axis=0)[None]
    pick = np.take_along_axis
    return pick(squares, best, axis=0)[0], pick(places, best[:, :, :, None], axis=0)[0]
