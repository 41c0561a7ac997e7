"""All calls of MMG, which makes a triangulation even by splitting, collapsing and flipping edges. Worker process only.

MMG needs no map of the surface onto a plane, so it handles thin flaps and margins, on which the maps of gmsh fold and
its mesher hardly ends. C. Dapogny, C. Dobrzynski, P. Frey: Three-dimensional adaptive domain remeshing, implicit domain
meshing, and applications to free and moving boundary problems, J. Comput. Phys. 262, 2014.
"""

import mmgpy
import numpy as np

Surface = tuple[np.ndarray, np.ndarray]
QUIET = -1
NO_RIDGES = 0
"""No angle between triangles is kept as a ridge, because the facets of a scan are arbitrary."""


class EvenRemesher:
    """A surface that is meshed with any number of sizes."""

    def __init__(self, points: np.ndarray, triangles: np.ndarray, nearness: float):
        """points (n, 3) [m], triangles (t, 3): a closed outward triangulation; nearness: largest distance of an edit
        from it, over the edge length."""
        self.nearness = nearness
        self.points, self.triangles = np.ascontiguousarray(points), np.ascontiguousarray(triangles, dtype=np.int32)

    def mesh(self, size: float) -> Surface:
        """Points (n, 3) [m] near the surface and outward triangles (t, 3) with edges of about `size` [m]."""
        mesh = mmgpy.MmgMeshS(self.points, self.triangles)
        mesh.remesh(hsiz=size, hausd=self.nearness * size, angle=NO_RIDGES, verbose=QUIET)
        triangles = np.asarray(mesh.get_triangles()).astype(np.int64)
        used, renumbered = np.unique(triangles, return_inverse=True)
        return np.asarray(mesh.get_vertices(), float)[used], renumbered.reshape(triangles.shape)
