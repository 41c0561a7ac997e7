"""The mesh of a reference: a mesh of the mesher with sides curved onto the true surface and outlines."""

from dataclasses import replace

import numpy as np
from skfem import MeshTet, MeshTet2

from reference_fem import SolveError, curve, nodes
from reference_fem.elements.shapes import check_neighbours
from studies.geometry import OrganMesh, ball_octant, curved, project_ball
from studies.meshing.held_mesh import HeldMesh, held_mesh, straight
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.shaping import laid_out
from studies.meshing.true_shape import as_curved, on_true_shape, true_shape
from studies.scene.scene import Scene

POLE_REFINEMENT = 0.35
"""Element size at the contact of an octant, over that elsewhere: at 10 % the contact is a third of the ball's."""


def reference_mesh(scene: Scene, level: float) -> tuple[MeshTet2, list[np.ndarray], np.ndarray]:
    """The second-order mesh on one level of the scene's plan, the nodes of each of its held regions, and the middles of
    the corners of the lumen's facets [m], (f, 3).

    A region is held at the nodes of its facets: a mid-side node outside them, across a dent, stays free. Raises
    StudyError for a mesh that cannot be made.
    """
    if scene.symmetric:
        return _curved_octant(scene, straight(_octant(scene, level))), [], np.empty((0, 3))
    organ_mesh = mesh_for(scene, int(level), on_shape=True, even=True)
    body = held_mesh(scene, organ_mesh)
    mesh = on_true_sides(scene, organ_mesh, body, body)
    *held, wall = body.facets(mesh)
    return mesh, [np.unique(facets) for facets in held], nodes(mesh)[wall[:, :3]].mean(axis=1)


def on_true_sides(scene: Scene, organ_mesh: OrganMesh, coarse: HeldMesh, body: HeldMesh) -> MeshTet2:
    """The second-order mesh of `body`, as curved as the coarse one, which follows the true shape; straight if only a
    mesh is known. Where an element would fold (scans, a few organs of a population), its sides are curved less. Raises
    StudyError."""
    shape, mesh = true_shape(scene.organ), MeshTet2.from_mesh(body.mesh)
    if shape is None:
        return mesh
    if scene.organ.shape != "file":
        smooth = curved(organ_mesh, may_fold=True)
        bent = as_curved(body, coarse, on_true_shape(smooth, coarse, shape, scene.held, scene.cuts))
        if not _folds(bent):
            return bent
    points = laid_out(scene, organ_mesh, coarse, body, shape)
    return replace(mesh, doflocs=np.ascontiguousarray(points.T))


def _folds(mesh: MeshTet2) -> bool:
    try:
        check_neighbours(mesh)
    except SolveError:
        return True
    return False


def _octant(scene: Scene, level: float) -> OrganMesh:
    radius = float(scene.organ.parameters["radius"])
    return ball_octant(radius, level * radius, POLE_REFINEMENT * level * radius)


def _curved_octant(scene: Scene, plain: MeshTet) -> MeshTet2:
    """The octant with nodes moved along the radius, so that nodes of a symmetry plane stay in it to the last bit;
    otherwise they would not be held."""
    radius = float(scene.organ.parameters["radius"])
    on_sphere = lambda x: np.linalg.norm(x, axis=0) > radius * (1 - 1e-6)  # noqa: E731
    return curve(plain, lambda x: project_ball(x.T, radius).T, on_sphere)
