"""All calls of MMG, which makes a triangulation even by splitting, collapsing and turning edges. Worker process only.

It needs no map of the surface onto a plane, so thin flaps and margins, on which gmsh's maps fold and its mesher then
hardly ends, are nothing special to it. C. Dapogny, C. Dobrzynski, P. Frey: Three-dimensional adaptive domain
remeshing, implicit domain meshing, and applications to free and moving boundary problems, J. Comput. Phys. 262, 2014.
"""

import mmgpy
import numpy as np

Surface = tuple[np.ndarray, np.ndarray]
QUIET = -1
NO_RIDGES = 0
"""No angle between triangles counts as a ridge to be kept: the facets of a scan are accidents."""


class EvenRemesher:
    """A surface meshed at as many sizes as wanted."""

    def __init__(self, points: np.ndarray, triangles: np.ndarray, nearness: float):
        """A closed outward triangulation: points (n, 3) [m], triangles (t, 3); nearness: how far an edit may leave it,
        over the size."""
        self.nearness = nearness
        self.points, self.triangles = np.ascontiguousarray(points), np.ascontiguousarray(triangles, dtype=np.int32)

    def mesh(self, size: float) -> Surface:
        """Points (n, 3) [m] near the surface and outward triangles (t, 3) with edges of about `size` [m]."""
        mesh = mmgpy.MmgMeshS(self.points, self.triangles)
        mesh.remesh(hsiz=size, hausd=self.nearness * size, angle=NO_RIDGES, verbose=QUIET)
        triangles = np.asarray(mesh.get_triangles()).astype(np.int64)
        used, renumbered = np.unique(triangles, return_inverse=True)
        return np.asarray(mesh.get_vertices(), float)[used], renumbered.reshape(triangles.shape)
