"""The mesh of an organ, and its basic measures."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Surface = tuple[np.ndarray, np.ndarray]
"""Points (n, 3) [m] and triangles (t, 3)."""


@dataclass(frozen=True, eq=False)
class OrganMesh:
    """A closed surface and, if filled, the tetrahedra whose boundary it is, node by node.

    A hollow organ has two surfaces, the outer one and that of the lumen; both bound its tissue.

    name: of the organ or file
    points: rest positions [m], shape (n, 3); the `surface_count` nodes of the boundary come first
    triangles: the whole boundary, shape (t, 3), anticlockwise seen from outside the tissue (of the lumen, from inside
        the lumen)
    tetrahedra: shape (k, 4), positive volumes; empty if not filled
    surface_count: number of boundary nodes
    patches: name -> indices of the outer surface's nodes inside that attachment region
    recipe: arguments with which the mesher makes the mesh, JSON-able
    outer_count: number of nodes of the outer surface, which come first of all (0 means `surface_count`); in a layered
        wall without halved elements node i + outer_count of the lumen faces node i
    losses: deviations of a mesh from the surface of its file (studies.geometry.scanned.fidelity)
    cuts: name -> faces inside the body, shape (f, 3), along which a cut will open it, anticlockwise seen from in front
        of its plane
    """

    name: str
    points: np.ndarray
    triangles: np.ndarray
    tetrahedra: np.ndarray
    surface_count: int
    patches: dict[str, np.ndarray] = field(default_factory=dict)
    recipe: dict[str, Any] = field(default_factory=dict)
    outer_count: int = 0
    losses: dict[str, Any] = field(default_factory=dict)
    cuts: dict[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "outer_count", self.outer_count or self.surface_count)

    @property
    def surfaces(self) -> dict[str, np.ndarray]:
        """Name -> indices into `triangles`: "outer" and, if hollow, "lumen"."""
        outer = (self.triangles < self.outer_count).all(axis=1)
        parts = {"outer": np.flatnonzero(outer)}
        return parts | {"lumen": np.flatnonzero(~outer)} if self.hollow else parts

    @property
    def hollow(self) -> bool:
        return self.outer_count < self.surface_count

    @property
    def outer_triangles(self) -> np.ndarray:
        """Triangles of the outer surface, shape (t, 3), outward."""
        return self.triangles[self.surfaces["outer"]]

    @property
    def lumen_triangles(self) -> np.ndarray:
        """Triangles around the lumen, turned so that they enclose it with positive volume, (t, 3)."""
        return self.triangles[self.surfaces["lumen"]][:, ::-1] if self.hollow else np.empty((0, 3), np.int64)

    @property
    def volume(self) -> float:
        """Volume [m^3] of the tissue, bounded by all of `triangles`."""
        return signed_volume(self.points, self.triangles)

    @property
    def outer_volume(self) -> float:
        """Volume [m^3] inside the outer surface: tissue and lumen."""
        return signed_volume(self.points, self.outer_triangles)

    @property
    def lumen_volume(self) -> float:
        """Volume [m^3] of the lumen; 0 for a solid organ."""
        return signed_volume(self.points, self.lumen_triangles) if self.hollow else 0.0

    def outer(self) -> "OrganMesh":
        """The outer surface alone, not filled."""
        return replace(
            self,
            points=self.points[: self.outer_count],
            triangles=self.outer_triangles,
            tetrahedra=np.empty((0, 4), np.int64),
            surface_count=self.outer_count,
            recipe=self.recipe | {"fill": False},
        )

    def patch_triangles(self, name: str) -> np.ndarray:
        """Boundary triangles, shape (s, 3), with all three nodes in patch `name`; KeyError if there is none."""
        inside = np.zeros(len(self.points), bool)
        inside[self.patches[name]] = True
        return self.triangles[inside[self.triangles].all(axis=1)]


def signed_volume(points: np.ndarray, triangles: np.ndarray) -> float:
    """V = 1/6 sum a . (b x c) [m^3] of closed triangles (t, 3), positive if they are outward.

    Coordinates are relative to the mean of the points, which reduces rounding.
    """
    a, b, c = (points[triangles] - points.mean(axis=0)).transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def triangle_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Normals with length 2 x area [m^2], shape (t, 3)."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def vertex_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals, shape (n, 3), of the nodes: means of the normals of their triangles, weighted by the angle there.

    G. Thuermer, C. Wuethrich: Computing vertex normals from polygonal facets, J. Graphics Tools 3(1), 1998.
    """
    normals = triangle_normals(points, triangles)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    total = np.zeros_like(points)
    for corner in range(3):
        here, after, before = (points[triangles[:, (corner + k) % 3]] for k in range(3))
        one, other = after - here, before - here
        cosine = np.einsum("ij,ij->i", one, other) / (np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1))
        np.add.at(total, triangles[:, corner], np.arccos(np.clip(cosine, -1.0, 1.0))[:, None] * normals)
    return total / np.linalg.norm(total, axis=1)[:, None]


def triangle_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Areas [m^2], shape (t,)."""
    return np.linalg.norm(triangle_normals(points, triangles), axis=1) / 2.0


def unique_edges(triangles: np.ndarray) -> np.ndarray:
    """Edges of the triangles, each once, shape (e, 2), lower index first, in lexicographic order."""
    return counted_edges(triangles)[0]


def counted_edges(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same and the number of triangles at each edge, (e,)."""
    pairs = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, first, count = np.unique(row_keys(pairs), return_index=True, return_counts=True)
    return pairs[first], count


def mean_edge(points: np.ndarray, triangles: np.ndarray) -> float:
    """Mean length [m] of the edges of triangles (t, 3)."""
    edges = unique_edges(triangles)
    return float(np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1).mean())


def connected(ends: np.ndarray, count: int) -> np.ndarray:
    """For each of `count` nodes the number of its part, (count,); links `ends` (m, 2) join the nodes of a part."""
    graph = coo_array((np.ones(len(ends)), tuple(ends.T)), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def compact(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points that cells (k, m) use, in their order, and the cells by their new numbers."""
    used, renumbered = np.unique(cells, return_inverse=True)
    return points[used], renumbered.reshape(cells.shape).astype(np.int64)


def tetrahedron_facets(tetrahedra: np.ndarray) -> np.ndarray:
    """The four faces of every one of the tetrahedra (k, 4), shape (4 k, 3), outward for positive volumes."""
    return tetrahedra[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)


def boundary_triangles(tetrahedra: np.ndarray) -> np.ndarray:
    """Faces that belong to one tetrahedron only, shape (t, 3), outward for tetrahedra of positive volume."""
    faces = tetrahedron_facets(tetrahedra)
    _, first, counts = np.unique(row_keys(np.sort(faces, axis=1)), return_index=True, return_counts=True)
    return faces[np.sort(first[counts == 1])]


def row_keys(rows: np.ndarray) -> np.ndarray:
    """One integer per row of indices, shape (n,), in the lexicographic order of the rows, which sorts fast.

    Rows have up to three indices below two million; AssertionError if the integers would overflow.
    """
    base = int(rows.max(initial=0)) + 1
    assert base ** rows.shape[1] < 2**63
    key = rows[:, 0].astype(np.int64)
    for column in rows.T[1:]:
        key = key * base + column
    return key


def same_triangles(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two sets of triangles are equal, whatever the order of triangles and corners."""
    if len(one) != len(other) or one.max() != other.max():
        return False
    rows = [np.sort(row_keys(np.sort(triangles, axis=1))) for triangles in (one, other)]
    return bool((rows[0] == rows[1]).all())


def tetrahedron_volumes(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Signed volumes [m^3], shape (k,)."""
    a, b, c, d = points[tetrahedra].transpose(1, 0, 2)
    return np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6.0


def turn_inverted(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """The tetrahedra (k, 4), those of negative volume with two corners exchanged, in place."""
    inverted = tetrahedron_volumes(points, tetrahedra) < 0
    tetrahedra[inverted] = tetrahedra[inverted][:, [0, 2, 1, 3]]
    return tetrahedra


def surface_first(points: np.ndarray, tetrahedra: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """The same body with its boundary nodes first: points, outward triangles, tetrahedra, number of boundary nodes."""
    triangles = boundary_triangles(tetrahedra)
    surface = np.unique(triangles)
    order = np.concatenate([surface, np.setdiff1d(np.arange(len(points)), surface)])
    new = np.empty(len(points), np.int64)
    new[order] = np.arange(len(points))
    return points[order], new[triangles], new[tetrahedra], len(surface)
