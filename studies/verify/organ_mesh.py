"""Meshes of organs for the second judge: Netgen fills their surface, so no tetrahedron is the reference's."""

from dataclasses import dataclass, replace

import numpy as np

from skfem import MeshTet2

from reference_fem import NeoHookean, PrescribedDisplacement, Problem, nodes
from reference_fem.crosscheck.netgen_fill import netgen_fill
from reference_fem.elements.shapes import element_nodes
from studies.geometry import OrganMesh, curved
from studies.geometry.mesh.jacobian import smallest_jacobian
from studies.grading.held_mesh import held_mesh
from studies.grading.true_shape import as_curved, on_true_shape, true_shape
from studies.reference.problem import rigid
from studies.scene.meshing import mesh_for
from studies.scene.scene import Scene

LEAST = 0.1
"""Smallest Jacobian that is left, over that of the straight element: Netgen's flat elements fold when they are curved."""
HALVES = 8
"""Times that a side is straightened by half at most."""


@dataclass(frozen=True)
class JudgeMesh:
    """How the judge cuts an organ into tetrahedra."""

    nodes: int
    """Surface vertices before any element is halved; none of the reference's."""
    at_outlines: int
    """Times that elements at outlines of held regions are halved."""
    at_contact: int = 0
    """Times that those are halved where an obstacle will be."""


def netgen_filled(scene: Scene, count: int) -> OrganMesh:
    """The scene's organ with `count` surface nodes, filled by Netgen. Raises StudyError, SolveError."""
    surface = mesh_for(scene, count, filled=False)
    points, tetrahedra = netgen_fill(surface.points, surface.triangles)
    return replace(surface, points=points, tetrahedra=tetrahedra)


def judged_problem(scene: Scene, mesh: JudgeMesh) -> Problem:
    """The scene on a mesh of the judge's, curved onto the true shape and outlines. Raises StudyError, SolveError."""
    organ_mesh = netgen_filled(scene, mesh.nodes)
    shape, coarse = true_shape(scene.organ), held_mesh(scene, organ_mesh)
    assert shape is not None  # organs of the catalogue have one
    body = coarse.refined(scene, mesh.at_outlines, mesh.at_contact)
    smooth = as_curved(
        body, coarse, upright(on_true_shape(curved(organ_mesh, may_fold=True), coarse, shape, scene.held))
    )
    *held, _ = body.facets(smooth)
    tissue, x = scene.tissue, nodes(smooth)
    return Problem(
        mesh=smooth,
        material=NeoHookean(tissue.shear_modulus, tissue.shear_modulus * tissue.bulk_over_shear),
        held=[at_nodes(x[np.unique(facets)], h.path) for facets, h in zip(held, scene.held, strict=True)],
        obstacles=[rigid(obstacle) for obstacle in scene.obstacles],
    )


def upright(mesh: MeshTet2) -> MeshTet2:
    """The mesh with the sides of elements that fold straightened by half as often as that takes."""
    x, cells = nodes(mesh).copy(), element_nodes(mesh)
    middles = x[mesh.edges].mean(axis=0)
    for _ in range(HALVES):
        folded = cells[smallest_jacobian(x, cells) < LEAST]
        if not len(folded):
            break
        sides = np.unique(folded[:, 4:])
        x[sides] = 0.5 * (x[sides] + middles[sides - mesh.nvertices])
    return replace(mesh, doflocs=np.ascontiguousarray(x.T))


def at_nodes(points: np.ndarray, path) -> PrescribedDisplacement:
    """Held at these rest points (n, 3) [m] and at no others."""
    known = {point.tobytes() for point in points}
    return PrescribedDisplacement(
        where=lambda x: np.array([column.tobytes() in known for column in x.T]), motion=path
    )
