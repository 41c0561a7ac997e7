"""From a scene to the mass-spring solver: the mesh, the body, the set-up of a run."""

from dataclasses import dataclass

import numpy as np

from massspring import (
    Attachment,
    Body,
    Material,
    Setup,
    StepLimit,
    make_clock,
    step_limit,
    surface_body,
    tetrahedral_body,
)
from studies.case import BodyRecipe, Case
from studies.errors import StudyError
from studies.geometry import OrganMesh, fill, organ, read_mesh
from studies.geometry.organs import SHAPES
from studies.scenes.base import Scene
from studies.suggest import choose


@dataclass(frozen=True, eq=False)
class Prepared:
    """All that a run needs, and what a report says about it."""

    mesh: OrganMesh
    setup: Setup
    limit: StepLimit


def mesh_for(scene: Scene, nodes: int, filled: bool = True) -> OrganMesh:
    """The scene's organ with `nodes` surface nodes; a mesh file comes as it is. Raises StudyError."""
    if choose(scene.organ.shape, [*SHAPES, "file"], "organ") != "file":
        return organ(scene.organ.shape, nodes, scene.regions, filled, scene.organ.parameters)
    parameters = scene.organ.parameters
    if "path" not in parameters or "unit" not in parameters:
        raise StudyError(
            f"scene '{scene.name}': an organ from a file needs a path and a unit, it has {dict(parameters)}"
        )
    mesh = read_mesh(parameters["path"], unit=parameters["unit"])
    return fill(mesh) if filled and not len(mesh.tetrahedra) else mesh


def body_for(scene: Scene, recipe: BodyRecipe, mesh: OrganMesh) -> Body:
    """The mass-spring body of the scene's tissue on a mesh. Raises StudyError or MassSpringError."""
    if not recipe.stiffness > 0:
        raise StudyError(f"the stiffness factor is {recipe.stiffness}; it must be positive")
    material = Material(scene.tissue.shear_modulus, scene.tissue.density)
    if recipe.kind == "surface":
        body = surface_body(mesh.points[: mesh.surface_count], mesh.triangles, material, recipe.axis)
    else:
        body = tetrahedral_body(mesh.points, mesh.triangles, mesh.tetrahedra, material, recipe.law)
    return body if recipe.stiffness == 1.0 else body.stiffened(recipe.stiffness)


def attachments_for(scene: Scene, mesh: OrganMesh) -> tuple[Attachment, ...]:
    """The nodes of each held region, found by geometry."""
    return tuple(Attachment(patch_nodes(mesh, held.name, held.region), held.path) for held in scene.held)


def patch_nodes(mesh: OrganMesh, name: str, region: object) -> np.ndarray:
    """Surface nodes of a patch: as the mesher outlined it, or for a mesh from a file those inside the region."""
    if name in mesh.patches:
        return mesh.patches[name]
    return np.flatnonzero(region.level(mesh.points[: mesh.surface_count]) <= 0)  # pyright: ignore[reportAttributeAccessIssue]


def prepare(case: Case) -> Prepared:
    """Mesh, body, clock, surroundings of a case. Raises StudyError, MassSpringError; warns of dt above the limit."""
    scene = case.scene
    reason = scene.skip(case.method)
    if reason is not None:
        raise StudyError(f"method '{case.method.name}' does not apply to scene '{scene.name}': {reason}")
    mesh = mesh_for(scene, case.body.nodes, filled=case.body.kind == "tetrahedral")
    body = body_for(scene, case.body, mesh)
    attachments = attachments_for(scene, mesh)
    held = np.concatenate([a.nodes for a in attachments]) if attachments else None
    limit = step_limit(body, scene.damping, held)
    dt = case.dt_fraction * limit.damped if case.dt == "auto" else float(case.dt)
    clock = make_clock(scene.duration, case.frames or scene.frames, dt, limit)
    setup = Setup(body, case.method, clock, scene.obstacles, attachments, scene.gravity, scene.damping)
    return Prepared(mesh, setup, limit)
