"""Scenes of organs on meshes of the second judge: other sizes than the reference's, and no side drawn to an outline."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from reference_fem import NeoHookean, PrescribedDisplacement, Problem, nodes
from studies.geometry import curved
from studies.meshing.held_mesh import held_mesh
from studies.meshing.opened_mesh import opened_elements
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.true_shape import as_curved, on_true_shape, true_shape
from studies.reference.problem import rigid
from studies.scene.scene import Scene


@dataclass(frozen=True)
class JudgeMesh:
    """How the judge cuts an organ into tetrahedra."""

    nodes: int
    """Surface vertices before any element is halved."""
    at_outlines: int
    """Times that elements at outlines of held regions are halved."""


def judged_problem(scene: Scene, mesh: JudgeMesh) -> Problem:
    """The scene on a mesh of the judge's, curved onto the true shape and outlines, opened if the scene cuts it.
    Raises StudyError."""
    organ_mesh, shape = mesh_for(scene, mesh.nodes, even=True), true_shape(scene.organ)
    assert shape is not None  # the judged organs are of the catalogue
    coarse = held_mesh(scene, organ_mesh)
    body = coarse.refined(scene, mesh.at_outlines, 0)
    solid = as_curved(body, coarse, on_true_shape(curved(organ_mesh), coarse, shape, scene.held, scene.cuts))
    *patches, _ = body.facets(solid)
    tissue, x = scene.tissue, nodes(solid)
    if scene.cuts:  # copies of a node stay where it was, so `x` holds them too
        solid, _ = opened_elements(solid, body.cut_faces)
    return Problem(
        mesh=solid,
        material=NeoHookean(tissue.shear_modulus, tissue.shear_modulus * tissue.bulk_over_shear),
        held=[held_at(x[np.unique(facets)], h.path) for facets, h in zip(patches, scene.held, strict=True)],
        obstacles=[rigid(obstacle) for obstacle in scene.obstacles],
    )


def held_at(points: np.ndarray, path: Callable) -> PrescribedDisplacement:
    """Held at these nodes (n, 3) [m] of the mesh and at no others."""
    places = {point.tobytes() for point in points}
    return PrescribedDisplacement(where=lambda x: np.array([point.tobytes() in places for point in x.T]), motion=path)
