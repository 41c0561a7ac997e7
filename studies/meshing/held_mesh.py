"""A tetrahedral mesh with its held regions and cuts, and its refinement by halving straight-sided elements."""

import logging
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from skfem import MeshTet, MeshTet2

from massspring import Obstacle
from reference_fem import facet_nodes
from studies.geometry import OrganMesh
from studies.geometry.mesh.organ_mesh import boundary_triangles, counted_edges, triangle_normals, unique_edges
from studies.geometry.surface.distance import distance_to_surface
from studies.meshing.scene_mesh import patch_nodes
from studies.scene.scene import Scene

SAME_POINT = 1e-9
"""Fraction of the size of the body below which two points coincide: far above round-off, far below an edge."""


@dataclass(frozen=True, eq=False)
class HeldMesh:
    """A mesh with straight sides, with its held regions, lumen and cuts."""

    mesh: MeshTet
    corners: np.ndarray
    """Vertices before any refinement [m], (n, 3)."""
    patches: list[np.ndarray]
    """Triangles of each held region, and last of the lumen, by `corners`, (f, 3). The facets of a finer mesh are parts
    of them."""
    cuts: list[np.ndarray] = field(default_factory=list)
    """Faces of each of the scene's cuts between tetrahedra, by `corners`, (f, 3), seen from in front of the cut."""

    def facets(self, mesh: MeshTet2) -> list[np.ndarray]:
        """For each patch the six nodes of its facets, (f, 6), in the second-order mesh with the same vertices."""
        table, reach = facet_nodes(mesh), SAME_POINT * float(np.ptp(self.corners))
        middles = self.mesh.p.T[table[:, :3]].mean(axis=1)
        return [
            table[distance_to_surface(middles, self.corners, patch) < reach] if len(patch) else table[:0]
            for patch in self.patches
        ]

    @cached_property
    def faces_of_cuts(self) -> list[np.ndarray]:
        """The faces of this mesh that are parts of each cut, seen from in front of it, (f, 3)."""
        x, reach = self.mesh.p.T, SAME_POINT * float(np.ptp(self.corners))
        by_cut = []
        for cut in self.cuts:
            inner = np.asarray(self.mesh.f2t)[1] >= 0
            faces = np.asarray(self.mesh.facets).T[inner].astype(np.int64)
            faces = faces[distance_to_surface(x[faces].mean(axis=1), self.corners, cut) < reach]
            normals = triangle_normals(x, faces)
            # A cut is flat: faces across it have their centre off the plane.
            normal = triangle_normals(self.corners, cut[:1])[0]
            by_cut.append(np.where((normals @ normal < 0)[:, None], faces[:, ::-1], faces))
        return by_cut

    @property
    def cut_faces(self) -> np.ndarray:
        return np.concatenate([np.empty((0, 3), np.int64), *self.faces_of_cuts])

    @cached_property
    def front(self) -> np.ndarray:
        """Vertices of the fronts of cuts, where they end inside the body: there the stress is singular."""
        return np.unique(self.rim(self.cut_faces)[0])

    def rim(self, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sides of the front and of the trace in the outer surface of `faces` (f, 3) of cuts, (s, 2) and (t, 2)."""
        sides, count = counted_edges(faces)
        outer = unique_edges(boundary_triangles(self.mesh.t.T.astype(np.int64)))
        key = np.array([self.mesh.nvertices, 1])
        rim = sides[count == 1]
        outside = np.isin(rim @ key, outer @ key)
        return rim[~outside], rim[outside]

    def at_outlines(self) -> np.ndarray:
        """Elements with a vertex on an outline, or on the front of a cut: there the stress is singular."""
        rims = [rim_sides(facets)[:, :2].ravel() for facets in self.facets(MeshTet2.from_mesh(self.mesh))]
        rims.append(self.front)
        return np.flatnonzero(np.isin(self.mesh.t, np.concatenate([*rims, []])).any(axis=0))

    def inside(self, obstacles: tuple[Obstacle, ...], t: float) -> np.ndarray:
        """Boundary elements with a vertex whose rest position is inside an obstacle at time t [s]."""
        outer = np.unique(boundary_triangles(self.mesh.t.T))
        x = self.mesh.p[:, outer].T
        deep = np.zeros(len(x), dtype=bool)
        for obstacle in obstacles:
            deep |= obstacle.gap(x, t) < 0
        return np.flatnonzero(np.isin(self.mesh.t, outer[deep]).any(axis=0))

    def bisected(self, elements: np.ndarray) -> "HeldMesh":
        """The mesh with each of the elements halved at its longest edge, and as many neighbours as that requires."""
        return self.halved(elements)[0]

    def halved(self, elements: np.ndarray) -> tuple["HeldMesh", np.ndarray]:
        """The same, and for each new element the number of the old one of which it is a part."""
        rounds: list[np.ndarray] = []

        class Recording(MeshTet):
            def _adaptive_sort_mesh(self, p: np.ndarray, t: np.ndarray, marked: np.ndarray) -> np.ndarray:
                rounds.append(marked)
                return super()._adaptive_sort_mesh(p, t, marked)

        talk = logging.getLogger("skfem.mesh.mesh")
        before = talk.level
        talk.setLevel(logging.ERROR)  # scikit-fem warns that it copies slices
        try:
            finer = Recording(self.mesh.p, self.mesh.t).refined(elements)
        finally:
            talk.setLevel(before)
        parents = np.arange(self.mesh.nelements)
        for marked in rounds:  # scikit-fem keeps one half in its place and puts the other at the end
            parents = np.concatenate((parents, parents[marked]))
        return replace(self, mesh=MeshTet(np.ascontiguousarray(finer.p), np.ascontiguousarray(finer.t))), parents

    def refined(self, scene: Scene, at_outlines: int, at_contact: int) -> "HeldMesh":
        """The mesh halved `at_outlines` times at the outlines, then `at_contact` times at the surface that obstacles of
        the scene reach by the last checkpoint."""
        finer = self
        for _ in range(at_outlines):
            finer = finer.bisected(finer.at_outlines())
        for _ in range(at_contact):
            finer = finer.bisected(finer.inside(scene.obstacles, scene.checkpoints[-1]))
        return finer


def held_mesh(scene: Scene, organ_mesh: OrganMesh) -> HeldMesh:
    """The organ's mesh with the scene's held regions and its lumen as patches."""
    patches = [patch_nodes(organ_mesh, held.name, held.region) for held in scene.held]
    lumen = np.arange(organ_mesh.outer_count, organ_mesh.surface_count)
    body = with_patches(straight(organ_mesh), [*patches, lumen])
    return replace(body, cuts=[organ_mesh.cuts[cut.name] for cut in scene.cuts])


def straight(organ_mesh: OrganMesh) -> MeshTet:
    return MeshTet(np.ascontiguousarray(organ_mesh.points.T), np.ascontiguousarray(organ_mesh.tetrahedra.T))


def with_patches(mesh: MeshTet, patches: list[np.ndarray]) -> HeldMesh:
    """A HeldMesh whose patches are the boundary facets with all vertices in a set of `patches`."""
    outer = boundary_triangles(mesh.t.T)
    return HeldMesh(mesh, mesh.p.T.copy(), [outer[np.isin(outer, patch).all(axis=1)] for patch in patches])


def rim_sides(facets: np.ndarray) -> np.ndarray:
    """The outline of a patch of six-node facets (f, 6): sides of one facet only, as end, end, middle, (s, 3)."""
    sides = facets[:, [[0, 1, 3], [1, 2, 4], [0, 2, 5]]].reshape(-1, 3)
    _, first, count = np.unique(sides[:, 2], return_index=True, return_counts=True)
    return sides[first[count == 1]]
