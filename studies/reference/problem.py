"""From a scene to the finite-element reference problem on one mesh of its family."""

import numpy as np
from scipy.spatial import KDTree
from skfem import MeshTet2

from massspring import Capsule, Obstacle, Plane, Probe
from reference_fem import (
    Cavity,
    NeoHookean,
    PrescribedDisplacement,
    Problem,
    RigidCapsule,
    RigidPlane,
    RigidSphere,
    nodes,
)
from studies.base.errors import StudyError
from studies.meshing.reference_mesh import reference_mesh
from studies.scene.scene import Scene

SAME_POINT = 1e-9
"""Fraction of the size of the body below which two nodes coincide: far above round-off, far below an edge."""


def reference_problem(scene: Scene, level: float) -> Problem:
    """The scene on mesh `level` of its reference plan, with curved second-order elements if the true surface is known.

    Raises StudyError for a mesh that cannot be made, SolveError for one that cannot be used.
    """
    return problem_on(scene, *reference_mesh(scene, level))


def problem_on(scene: Scene, mesh: MeshTet2, patches: list[np.ndarray], lumen: np.ndarray | None) -> Problem:
    """The scene on a second-order mesh, with the nodes of each held region and the middles of the corners of the
    lumen's facets [m], (f, 3); None if it is not filled, as after a cut that opened it. Raises StudyError."""
    tissue = scene.tissue
    return Problem(
        mesh=mesh,
        material=NeoHookean(tissue.shear_modulus, tissue.shear_modulus * tissue.bulk_over_shear),
        held=_symmetry_planes() if scene.symmetric else _held(scene, mesh, patches),
        obstacles=tuple(rigid(o) for o in kept_obstacles(scene)),
        gravity=scene.gravity,
        density=tissue.density,
        cavities=(_cavity(scene, lumen),) if scene.filled and lumen is not None else (),
        faces_touch=any(cut.contact for cut in scene.cuts),
    )


def _cavity(scene: Scene, middles: np.ndarray) -> Cavity:
    """The lumen as a cavity whose wall consists of the facets with these middles (f, 3) [m]; its volume follows the
    scene."""
    if not len(middles):
        raise StudyError(f"scene '{scene.name}' fills a lumen, but its {scene.organ.shape} has none; leave it out")
    assert scene.lumen is not None  # it is filled
    tree, reach = KDTree(middles), SAME_POINT * float(np.ptp(middles))
    return Cavity(where=lambda x: tree.query(x.T)[0] < reach, volume=scene.lumen.filling)


def kept_obstacles(scene: Scene) -> tuple[Obstacle, ...]:
    """The obstacles of the reference: for an octant only those on its side of the symmetry planes."""
    if not scene.symmetric:
        return scene.obstacles
    return tuple(o for o in scene.obstacles if (o.anchor >= 0).all())


def whole_forces(scene: Scene, forces: np.ndarray) -> np.ndarray:
    """Forces of all scene obstacles (K, o, 3) [N] from those of the kept ones (K, kept, 3).

    An obstacle centred on an axis presses four octants; the force components across the axis cancel.
    """
    if not scene.symmetric:
        return forces
    kept = np.array([o.anchor for o in kept_obstacles(scene)])
    whole = np.zeros((len(forces), len(scene.obstacles), 3))
    for number, obstacle in enumerate(scene.obstacles):
        at = obstacle.anchor
        twin = int(np.argmin(np.linalg.norm(kept - np.abs(at), axis=1)))
        whole[:, number] = np.sign(at) * forces[:, twin] * 2.0 ** np.count_nonzero(at == 0)
    return whole


def _symmetry_planes() -> tuple[PrescribedDisplacement, ...]:
    return tuple(
        PrescribedDisplacement(where=lambda x, axis=axis: np.abs(x[axis]) < 1e-12, components=(axis,))
        for axis in range(3)
    )


def _held(scene: Scene, mesh: MeshTet2, patches: list[np.ndarray]) -> tuple[PrescribedDisplacement, ...]:
    points = nodes(mesh)
    reach = SAME_POINT * float(np.ptp(points))
    trees = [KDTree(points[patch]) for patch in patches]
    return tuple(
        PrescribedDisplacement(where=lambda x, tree=tree: tree.query(x.T)[0] < reach, motion=held.path)
        for held, tree in zip(scene.held, trees, strict=True)
    )


def rigid(obstacle: Obstacle) -> RigidPlane | RigidSphere | RigidCapsule:
    """The obstacle as one of reference_fem. Raises StudyError for a kind that it does not support."""
    if isinstance(obstacle, Probe):
        raise StudyError(
            f"the reference knows planes, spheres and capsules, not the thin probe at {obstacle.tip}; "
            f"use a sphere wider than its elements, or a scene without reference"
        )
    if obstacle.friction not in (0, "no_slip"):
        raise StudyError(
            f"an obstacle has friction {obstacle.friction}, and the reference knows contact without friction (0) or "
            f"without slip ('no_slip'); choose one of the two, or a scene without reference"
        )
    slip = "no_slip" if obstacle.friction == "no_slip" else "frictionless"
    if isinstance(obstacle, Plane):
        return RigidPlane(obstacle.point, tuple(obstacle.unit_normal), obstacle.path, slip)
    if isinstance(obstacle, Capsule):
        return RigidCapsule(obstacle.start, obstacle.end, obstacle.radius, obstacle.path, slip)
    return RigidSphere(obstacle.centre, obstacle.radius, obstacle.path, slip)
