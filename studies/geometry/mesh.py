"""The mesh of an organ, and the few numbers that everybody asks of it."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class OrganMesh:
    """A closed surface and, when filled, the tetrahedra of which it is the boundary, node by node.

    name: what it is
    points: rest positions [m], shape (n, 3); the `surface_count` nodes of the surface come first
    triangles: surface, shape (t, 3), seen anticlockwise from outside
    tetrahedra: shape (k, 4), positive volumes; empty when not filled
    surface_count: number of surface nodes
    patches: name -> indices of the surface nodes inside that attachment region
    recipe: how to make it again, JSON-able
    """

    name: str
    points: np.ndarray
    triangles: np.ndarray
    tetrahedra: np.ndarray
    surface_count: int
    patches: dict[str, np.ndarray] = field(default_factory=dict)
    recipe: dict[str, Any] = field(default_factory=dict)

    @property
    def volume(self) -> float:
        """Enclosed volume [m^3] of the polyhedron."""
        return signed_volume(self.points, self.triangles)

    @property
    def area(self) -> float:
        """Area of the surface [m^2]."""
        return float(triangle_areas(self.points, self.triangles).sum())

    def patch_triangles(self, name: str) -> np.ndarray:
        """Surface triangles, shape (s, 3), with all three nodes in patch `name`."""
        inside = np.zeros(len(self.points), bool)
        inside[self.patches[name]] = True
        return self.triangles[inside[self.triangles].all(axis=1)]


def signed_volume(points: np.ndarray, triangles: np.ndarray) -> float:
    """V = 1/6 sum a . (b x c) [m^3], measured from the middle of the points to keep digits."""
    a, b, c = (points[triangles] - points.mean(axis=0)).transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def triangle_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Normals with length 2 x area [m^2], shape (t, 3)."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def triangle_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Areas [m^2], shape (t,)."""
    return np.linalg.norm(triangle_normals(points, triangles), axis=1) / 2.0


def unique_edges(triangles: np.ndarray) -> np.ndarray:
    """Edges of the triangles, each once, shape (e, 2), lower index first."""
    pairs = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    return np.unique(np.sort(pairs, axis=1), axis=0)


def boundary_triangles(tetrahedra: np.ndarray) -> np.ndarray:
    """Faces that belong to one tetrahedron only, shape (t, 3), outward for tetrahedra of positive volume."""
    faces = tetrahedra[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    _, first, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[counts == 1])]


def tetrahedron_volumes(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Signed volumes [m^3], shape (k,)."""
    a, b, c, d = points[tetrahedra].transpose(1, 0, 2)
    return np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6.0


def surface_first(points: np.ndarray, tetrahedra: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """The same body with its boundary nodes first: points, outward triangles, tetrahedra, number of boundary nodes."""
    triangles = boundary_triangles(tetrahedra)
    surface = np.unique(triangles)
    order = np.concatenate([surface, np.setdiff1d(np.arange(len(points)), surface)])
    new = np.empty(len(points), np.int64)
    new[order] = np.arange(len(points))
    return points[order], new[triangles], new[tetrahedra], len(surface)
