"""The mesh of a reference: the mesher's, finer where it counts, its sides curved onto the true surface and outlines."""

import logging
from dataclasses import dataclass, replace

import numpy as np
from skfem import MeshTet, MeshTet2

from massspring import Obstacle
from reference_fem import Evaluator, curve, facet_nodes, nodes
from reference_fem.elements.shapes import edge_index
from studies.base.lookup import lookup
from studies.geometry import OrganMesh, ball_octant, curved, project_ball
from studies.geometry.mesh.jacobian import PAIRS
from studies.geometry.mesh.organ_mesh import boundary_triangles
from studies.geometry.organs import SHAPES
from studies.geometry.shape.levelset import Shape, project
from studies.geometry.surface.distance import distance_to_surface
from studies.scene.meshing import mesh_for, patch_nodes
from studies.scene.scene import Held, Organ, Scene

POLE_REFINEMENT = 0.35
"""Element size at the contact of an octant, over that elsewhere: at 10 % the contact is a third of the ball's."""
SAME_POINT = 1e-9
"""Two points closer than this fraction of the body are one: far above rounding, far below an edge."""


def reference_mesh(scene: Scene, level: float) -> tuple[MeshTet2, list[np.ndarray], np.ndarray]:
    """The second-order mesh on one level of the scene's plan, the nodes of each of its held regions, and the middles of
    the corners of the lumen's facets [m], (f, 3).

    A region is held at the nodes of its facets: a mid-side node outside them, across a dent, stays free.
    Raises StudyError for a mesh that cannot be made.
    """
    plan = scene.reference
    assert plan is not None  # never called for a scene without one
    if scene.symmetric:
        return _curved_octant(scene, _straight(_octant(scene, level))), [], np.empty((0, 3))
    organ_mesh = mesh_for(scene, int(level))
    patches = [patch_nodes(organ_mesh, held.name, held.region) for held in scene.held]
    lumen = np.arange(organ_mesh.outer_count, organ_mesh.surface_count)
    body = coarse = coarse_body(_straight(organ_mesh), [*patches, lumen])
    for _ in range(plan.at_outlines):
        body = body.bisected(body.at_outlines())
    for _ in range(plan.at_contact):
        body = body.bisected(body.inside(scene.obstacles, scene.checkpoints[-1]))
    shape = true_shape(scene.organ)
    mesh = MeshTet2.from_mesh(body.mesh)
    if shape is not None:
        mesh = _curved(body, coarse, _on_true_shape(organ_mesh, coarse, shape, scene.held))
    *held, wall = body.facets(mesh)
    return mesh, [np.unique(facets) for facets in held], nodes(mesh)[wall[:, :3]].mean(axis=1)


def _octant(scene: Scene, level: float) -> OrganMesh:
    radius = float(scene.organ.parameters["radius"])
    return ball_octant(radius, level * radius, POLE_REFINEMENT * level * radius)


def _straight(organ_mesh: OrganMesh) -> MeshTet:
    return MeshTet(np.ascontiguousarray(organ_mesh.points.T), np.ascontiguousarray(organ_mesh.tetrahedra.T))


def _curved_octant(scene: Scene, straight: MeshTet) -> MeshTet2:
    """Moved along the radius: a node of a symmetry plane stays in it to the last bit, or it would not be held there."""
    radius = float(scene.organ.parameters["radius"])
    on_sphere = lambda x: np.linalg.norm(x, axis=0) > radius * (1 - 1e-6)  # noqa: E731
    return curve(straight, lambda x: project_ball(x.T, radius).T, on_sphere)


def _curved(body: "MeshedBody", coarse: "MeshedBody", curved_coarse: MeshTet2) -> MeshTet2:
    """The finer mesh with sides as curved as those of the coarse one that lie on the true shape.

    The quadratic map of a coarse element takes its parts with it exactly, so they stay upright however small they are;
    moving each new vertex onto the surface by itself folds small elements beside large ones.
    """
    if body is coarse:
        return curved_coarse
    plain, finer = MeshTet2.from_mesh(coarse.mesh), MeshTet2.from_mesh(body.mesh)
    move = Evaluator(plain).displacement(nodes(curved_coarse) - nodes(plain), nodes(finer))
    return replace(finer, doflocs=np.ascontiguousarray((nodes(finer) + move).T))


def _on_true_shape(organ_mesh: OrganMesh, body: "MeshedBody", shape: Shape, helds: tuple[Held, ...]) -> MeshTet2:
    """The mesh with the nodes of its boundary on the true surfaces, those of outlines on the true outlines.

    A polygon instead would hold the body h²/8r too little or too much, of first order in the force.
    """
    mesh, smooth = MeshTet2.from_mesh(body.mesh), curved(organ_mesh)
    points = nodes(mesh).copy()
    points[mesh.nvertices + edge_index(mesh, smooth.cells[:, np.array(PAIRS)].reshape(-1, 2))] = smooth.points[
        smooth.cells[:, 4:].ravel()
    ]
    for held, facets in zip(helds, body.facets(mesh)[: len(helds)], strict=True):
        rim = np.unique(rim_sides(facets))
        points[rim] = project(shape, points[rim], (held.region.level,))
    return replace(mesh, doflocs=np.ascontiguousarray(points.T))


def true_shape(organ: Organ) -> Shape | None:
    """The organ as a level function; None where only a mesh is known."""
    return None if organ.shape == "file" else lookup(organ.shape, SHAPES, "organ")(**organ.parameters)


@dataclass(frozen=True, eq=False)
class MeshedBody:
    """A mesh with straight sides, and where on its surface it is held."""

    mesh: MeshTet
    corners: np.ndarray
    """Vertices before any refinement [m], (n, 3)."""
    patches: list[np.ndarray]
    """Of each held region and last of the lumen: its triangles of `corners`, (f, 3). A finer mesh has parts of them."""

    def facets(self, mesh: MeshTet2) -> list[np.ndarray]:
        """Of each patch the six nodes of its facets (f, 6) in the second-order mesh with the same vertices."""
        table, reach = facet_nodes(mesh), SAME_POINT * float(np.ptp(self.corners))
        middles = self.mesh.p.T[table[:, :3]].mean(axis=1)
        return [
            table[distance_to_surface(middles, self.corners, patch) < reach] if len(patch) else table[:0]
            for patch in self.patches
        ]

    def at_outlines(self) -> np.ndarray:
        """Elements with a vertex on an outline: there the stress is singular."""
        rims = [rim_sides(facets)[:, :2].ravel() for facets in self.facets(MeshTet2.from_mesh(self.mesh))]
        return np.flatnonzero(np.isin(self.mesh.t, np.concatenate([*rims, []])).any(axis=0))

    def inside(self, obstacles: tuple[Obstacle, ...], t: float) -> np.ndarray:
        """Boundary elements with a vertex that at rest is where an obstacle will be at time t [s]."""
        outer = np.unique(boundary_triangles(self.mesh.t.T))
        x = self.mesh.p[:, outer].T
        deep = np.zeros(len(x), dtype=bool)
        for obstacle in obstacles:
            deep |= obstacle.gap(x, t) < 0
        return np.flatnonzero(np.isin(self.mesh.t, outer[deep]).any(axis=0))

    def bisected(self, elements: np.ndarray) -> "MeshedBody":
        """Each of the elements halved at its longest edge, and of their neighbours as many as that takes."""
        talk = logging.getLogger("skfem.mesh.mesh")
        before = talk.level
        talk.setLevel(logging.ERROR)  # it tells that its own slices are copied
        try:
            finer = self.mesh.refined(elements)
        finally:
            talk.setLevel(before)
        return replace(self, mesh=MeshTet(np.ascontiguousarray(finer.p), np.ascontiguousarray(finer.t)))


def coarse_body(mesh: MeshTet, patches: list[np.ndarray]) -> MeshedBody:
    """A body that is held at the boundary facets whose vertices are all in one of the patches."""
    outer = boundary_triangles(mesh.t.T)
    return MeshedBody(mesh, mesh.p.T.copy(), [outer[np.isin(outer, patch).all(axis=1)] for patch in patches])


def rim_sides(facets: np.ndarray) -> np.ndarray:
    """The outline of a patch of six-node facets (f, 6): sides of one facet only, as end, end, middle, (s, 3)."""
    sides = facets[:, [[0, 1, 3], [1, 2, 4], [0, 2, 5]]].reshape(-1, 3)
    _, first, count = np.unique(sides[:, 2], return_index=True, return_counts=True)
    return sides[first[count == 1]]
