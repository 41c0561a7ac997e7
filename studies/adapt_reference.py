"""From a scene to the finite-element reference problem on one mesh of its family."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import KDTree
from skfem import MeshTet, MeshTet2

from massspring import Obstacle, Plane
from reference_fem import Held as HeldPatch
from reference_fem import NeoHookean, Problem, RigidPlane, RigidSphere, curve, facet_nodes, nodes
from studies.adapt import mesh_for, patch_nodes
from studies.geometry import OrganMesh, ball_octant
from studies.geometry.levelset import project
from studies.geometry.organs import SHAPES
from studies.scenes.base import Organ, Scene
from studies.suggest import choose

POLE_REFINEMENT = 0.35
"""Element size at the contact of an octant, over that elsewhere: at 10 % the contact is a third of the ball's."""
SAME_POINT = 1e-9
"""Two nodes closer than this fraction of the body are one: far above rounding, far below an edge."""


def reference_problem(scene: Scene, level: float) -> Problem:
    """The scene on mesh `level` of its reference plan, curved second order where the true surface is known.

    Raises StudyError for a mesh that cannot be made, ReferenceProblem for one that cannot be used.
    """
    tissue = scene.tissue
    organ_mesh = _octant(scene, level) if scene.symmetric else mesh_for(scene, int(level))
    mesh = _curved(scene, organ_mesh)
    return Problem(
        mesh=mesh,
        material=NeoHookean(tissue.shear_modulus, tissue.shear_modulus * tissue.bulk_over_shear),
        held=_symmetry_planes() if scene.symmetric else tuple(_held(scene, organ_mesh, mesh)),
        obstacles=tuple(_rigid(o) for o in kept_obstacles(scene)),
        gravity=scene.gravity,
        density=tissue.density,
    )


def anchor(obstacle: Obstacle) -> np.ndarray:
    """Point of a plane or centre of a sphere [m], (3,)."""
    return np.asarray(obstacle.point if isinstance(obstacle, Plane) else obstacle.centre, dtype=float)


def kept_obstacles(scene: Scene) -> tuple[Obstacle, ...]:
    """The obstacles the reference sees: of an octant only those on its side of the symmetry planes."""
    if not scene.symmetric:
        return scene.obstacles
    return tuple(o for o in scene.obstacles if (anchor(o) >= 0).all())


def whole_forces(scene: Scene, forces: np.ndarray) -> np.ndarray:
    """Forces of all scene obstacles (K, o, 3) [N] from those of the kept ones (K, kept, 3).

    An obstacle centred on an axis presses four octants; what they feel across the axis cancels.
    """
    if not scene.symmetric:
        return forces
    kept = np.array([anchor(o) for o in kept_obstacles(scene)])
    whole = np.zeros((len(forces), len(scene.obstacles), 3))
    for number, obstacle in enumerate(scene.obstacles):
        at = anchor(obstacle)
        twin = int(np.argmin(np.linalg.norm(kept - np.abs(at), axis=1)))
        whole[:, number] = np.sign(at) * forces[:, twin] * 2.0 ** np.count_nonzero(at == 0)
    return whole


def _octant(scene: Scene, level: float) -> OrganMesh:
    radius = float(scene.organ.parameters["radius"])
    return ball_octant(radius, level * radius, POLE_REFINEMENT * level * radius)


def _curved(scene: Scene, organ_mesh: OrganMesh) -> MeshTet2:
    straight = MeshTet(np.ascontiguousarray(organ_mesh.points.T), np.ascontiguousarray(organ_mesh.tetrahedra.T))
    move = true_surface(scene.organ)
    if move is None:
        return MeshTet2.from_mesh(straight)
    if scene.symmetric:
        radius = float(scene.organ.parameters["radius"])
        return curve(straight, move, lambda x: np.linalg.norm(x, axis=0) > radius * (1 - 1e-6))
    return curve(straight, move, lambda x: np.ones(x.shape[1], dtype=bool))


def true_surface(organ: Organ) -> Callable[[np.ndarray], np.ndarray] | None:
    """Projection of points (3, N) [m] onto the organ's true surface; None where only a mesh is known."""
    if organ.shape == "file":
        return None
    shape = choose(organ.shape, SHAPES, "organ")(**organ.parameters)
    return lambda x: project(shape, np.ascontiguousarray(x.T)).T


def _symmetry_planes() -> tuple[HeldPatch, ...]:
    return tuple(HeldPatch(where=lambda x, axis=axis: np.abs(x[axis]) < 1e-12, components=(axis,)) for axis in range(3))


def _held(scene: Scene, organ_mesh: OrganMesh, mesh: MeshTet2) -> list[HeldPatch]:
    """A patch is held at the nodes of its facets: a mid-side node outside them, across a dent, stays free."""
    table, points = facet_nodes(mesh), nodes(mesh)
    reach = SAME_POINT * float(np.ptp(points))
    patches = []
    for held in scene.held:
        inside = np.zeros(len(points), dtype=bool)
        inside[patch_nodes(organ_mesh, held.name, held.region)] = True
        tree = KDTree(points[np.unique(table[inside[table[:, :3]].all(axis=1)])])
        patches.append(HeldPatch(where=lambda x, tree=tree: tree.query(x.T)[0] < reach, motion=held.path))
    return patches


def _rigid(obstacle: Obstacle) -> RigidPlane | RigidSphere:
    if isinstance(obstacle, Plane):
        return RigidPlane(obstacle.point, tuple(obstacle.unit_normal), obstacle.path)
    return RigidSphere(obstacle.centre, obstacle.radius, obstacle.path)
