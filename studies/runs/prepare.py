"""Prepares a case for the mass-spring solver: mesh, body, set-up of the run."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import import_module

import numpy as np

from massspring import (
    Attachment,
    Body,
    Event,
    Material,
    Ramp,
    Setup,
    StepLimit,
    make_clock,
    membrane_body,
    step_limit,
    surface_body,
    tetrahedral_body,
)
from massspring.body.opening import parents
from massspring.body.volumes import Volumes
from massspring.methods.capabilities import No
from massspring.world.obstacles import Surroundings
from studies.base.errors import DoesNotApply, StudyError
from studies.geometry import OrganMesh
from studies.geometry.mesh.organ_mesh import triangle_areas
from studies.meshing.opened_mesh import Opened, cells_of, opened_in_stages
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.meshing.scene_mesh import mesh_for, patch_nodes
from studies.meshing.virtual_mesh import Tissue, VirtualMesh, virtual_mesh
from studies.runs.case import Case
from studies.runs.cutting import (
    LUMEN,
    Opening,
    check_blades,
    check_held,
    check_opens,
    check_virtual,
    event_of,
    keeping_pieces,
    opening_of,
    surface_pieces,
)
from studies.runs.heavy import Heaviness, heaviness
from studies.runs.limits import check_size
from studies.runs.quadratic import check_masses, flat_mesh, quadratic_for
from studies.runs.recipes import (
    ADAPTER,
    ADAPTIVE,
    VIRTUAL,
    BodyRecipe,
    MembraneBody,
    QuadraticBody,
    SurfaceBody,
    TetrahedralBody,
)
from studies.runs.user_code import own_laws, sprung_by
from studies.scene.clock import event_frames, frames_between
from studies.scene.scene import Scene

WHOLE = "whole"


@dataclass(frozen=True, eq=False)
class Prepared:
    """All data that a run and its record need."""

    mesh: OrganMesh
    setup: Setup
    limit: StepLimit
    opening: Opening | None = None
    """The cut of the body, if there is one; `mesh` is then the mesh after the cut."""
    limit_before: StepLimit | None = None
    """Step limit before the cut; `limit` is that of the whole run."""
    tissue: Tissue | None = None
    """Tissue of a body with virtual nodes, which is recorded and whose mesh is `mesh`; None: the body itself is
    recorded."""
    heaviness: Heaviness | None = None
    """Of a body that is as heavy as its scene allows."""

    @property
    def body(self) -> Body:
        """The last body of the run, whose node numbers the record uses."""
        return self.setup.events[-1].body if self.setup.events else self.setup.body


def mesh_of(scene: Scene, recipe: BodyRecipe) -> OrganMesh | QuadraticMesh:
    """The mesh for a recipe. Raises StudyError."""
    quadratic = isinstance(recipe, QuadraticBody)
    if recipe.cut == VIRTUAL:
        scene = replace(scene, cuts=())  # the mesh is made without the cut
    if recipe.graded == ADAPTIVE:
        # Not imported statically, so that code that solves references does not make other runs stale
        # (studies.runs.current).
        return import_module(ADAPTER).adaptive_mesh(scene, recipe.nodes)
    if recipe.graded or quadratic:
        # Loaded on demand, since it imports the finite elements.
        from studies.meshing.graded_mesh import graded_mesh, usual_grading

        return graded_mesh(scene, recipe.nodes, *(usual_grading(scene) if recipe.graded else (0, 0)), quadratic)
    # The paper's body of a hollow organ is only its outer surface; the density of the content needs the wall. A cut is
    # meshed with the tissue on both sides.
    inside = scene.lumen is not None or bool(scene.cuts)
    return mesh_for(scene, recipe.nodes, filled=isinstance(recipe, TetrahedralBody) or inside)


def body_for(
    scene: Scene, recipe: BodyRecipe, mesh: OrganMesh | QuadraticMesh, share: np.ndarray | None = None
) -> Body:
    """The mass-spring body of the scene's tissue on a mesh; `share` (k,): part of each tetrahedron that is tissue.

    Raises StudyError or MassSpringError."""
    if not recipe.stiffness > 0:
        raise StudyError(f"the stiffness factor is {recipe.stiffness}; it must be positive")
    if isinstance(recipe, QuadraticBody) and isinstance(mesh, QuadraticMesh):
        return quadratic_for(scene, recipe, mesh)
    assert isinstance(mesh, OrganMesh)  # mesh_of makes a quadratic mesh for a quadratic body alone
    material = Material(scene.tissue.shear_modulus, scene.tissue.density)
    outside = mesh.outer() if mesh.hollow else mesh
    if isinstance(recipe, MembraneBody):
        body = wall_for(scene, recipe, mesh, material)
    elif isinstance(recipe, SurfaceBody):
        body = surface_body(
            outside.points[: outside.outer_count], outside.triangles, material, recipe.axis, recipe.weights
        )
    elif recipe.law in own_laws():
        body = tetrahedral_body(mesh.points, mesh.triangles, mesh.tetrahedra, material, share=share)
        body = sprung_by(body, own_laws()[recipe.law], material.shear_modulus)
    else:
        body = tetrahedral_body(mesh.points, mesh.triangles, mesh.tetrahedra, material, recipe.law, share)
    if recipe.stiffness != 1.0:
        body = body.stiffened(recipe.stiffness)
    volumes = volumes_for(scene, recipe, mesh, body)
    if scene.cuts:
        return keeping_pieces(body, volumes)
    return body if volumes is None else body.keeping(volumes)


def wall_for(scene: Scene, recipe: MembraneBody, mesh: OrganMesh, material: Material) -> Body:
    """A hollow organ as a membrane on its outer surface, with the mean thickness of its wall. Raises StudyError."""
    if not mesh.hollow:
        raise StudyError(f"scene '{scene.name}' has a solid organ; a membrane is for the wall of a hollow one")
    outside = mesh.outer()
    thickness = mesh.volume / triangle_areas(outside.points, outside.triangles).sum()
    # The content has the density of the tissue, as in a surface body.
    content = material.density * (1.0 - mesh.volume / mesh.outer_volume)
    return membrane_body(outside.points, outside.triangles, float(thickness), material, recipe.law, content)


def volumes_for(scene: Scene, recipe: BodyRecipe, mesh: OrganMesh, body: Body) -> Volumes | None:
    """The kept volumes of a recipe; None for the tissue as a whole. Raises MassSpringError for volumes that the body
    does not have."""
    closed = isinstance(recipe, TetrahedralBody) and mesh.hollow and scene.filled
    if closed and recipe.volumes == "whole":
        return Volumes.closed_surfaces(body, {WHOLE: mesh.outer_triangles})
    if closed and recipe.volumes == "scene":
        return Volumes.closed_surfaces(body, {"wall": mesh.triangles, LUMEN: mesh.lumen_triangles})
    if recipe.volumes in ("scene", "whole"):
        return None
    if recipe.volumes == "regions":
        tissue = Volumes.regions(body, recipe.regions)
    else:
        tissue = Volumes.nodal(body) if recipe.volumes == "nodal" else Volumes.patches(body)
    return tissue.joined(Volumes.closed_surfaces(body, {LUMEN: mesh.lumen_triangles})) if closed else tissue


def targets_for(scene: Scene, mesh: OrganMesh, body: Body) -> dict[str, Ramp]:
    """Targets of the kept volumes when the lumen is filled."""
    if scene.lumen is None or not scene.lumen.changes:
        return {}
    filling = scene.lumen.filling
    if LUMEN in body.kept.names:
        return {LUMEN: filling}
    # A single volume of wall and content grows by the growth of the content.
    share = mesh.lumen_volume / (mesh.lumen_volume + mesh.volume)
    return {body.kept.names[0]: Ramp(filling.times, tuple(1.0 + share * (f - 1.0) for f in filling.values))}


def attachments_for(scene: Scene, mesh: OrganMesh) -> tuple[Attachment, ...]:
    """The nodes of each held region, found by geometry."""
    return tuple(Attachment(patch_nodes(mesh, held.name, held.region), held.path) for held in scene.held)


def check_applies(case: Case, body: Body, targets: bool) -> None:
    """Raises DoesNotApply for a body, or surroundings in the scene, that the method does not support; `targets`:
    whether there are targets of kept volumes."""
    scene, method = case.scene, case.method
    reason = method.why_not(body)
    if reason is not None:
        raise DoesNotApply(f"method '{method.name}' does not apply to the {case.body.kind} body: {reason}")
    touching = method.capabilities.face_contact
    if any(cut.contact for cut in scene.cuts) and isinstance(touching, No):
        raise DoesNotApply(
            f"method '{method.name}' does not apply to scene '{scene.name}', whose faces of the cut touch: "
            f"{touching.because}; take implicit_volume"
        )
    around = Surroundings(scene.obstacles, len(scene.held), scene.gravity, targets, scene.start is not None)
    reason = method.why_not_among(around)
    if reason is not None:
        raise DoesNotApply(f"method '{method.name}' does not apply to scene '{scene.name}': {reason}")


def prepare(case: Case) -> Prepared:
    """Mesh, body, clock, surroundings of a case. Raises StudyError, MassSpringError."""
    scene = case.scene
    reason = scene.skip(case.method.name)
    if reason is not None:
        raise DoesNotApply(f"method '{case.method.name}' does not apply to scene '{scene.name}': {reason}")
    check_masses(scene, case.body)
    check_opens(scene, case.body)
    check_blades(scene, case.body.kind)
    mesh = mesh_of(scene, case.body)
    from studies.meshing.kept_shape import check_reach, tell_contact, tell_shape  # imports the finite elements

    at_nodes = not isinstance(case.body, QuadraticBody) or case.body.contact == "nodes"
    check_reach(scene, mesh, at_nodes)
    tell_shape(scene, mesh, filled=isinstance(case.body, TetrahedralBody | QuadraticBody))
    tell_contact(scene, mesh, adaptive=case.body.graded == ADAPTIVE)
    return prepared_on(case, mesh)


def prepared_on(case: Case, mesh: OrganMesh | QuadraticMesh) -> Prepared:
    """The same on a given mesh. Raises StudyError, MassSpringError."""
    scene = case.scene
    if case.body.cut == VIRTUAL:
        check_virtual(scene)
    given, body = mesh, body_for(scene, case.body, mesh)
    mesh = flat_mesh(mesh, body)
    targets = targets_for(scene, mesh, body)
    check_applies(case, body, bool(targets))
    if isinstance(case.body, SurfaceBody | MembraneBody) and mesh.hollow:
        mesh = mesh.outer()
    attachments, frames = attachments_for(scene, mesh), frames_between(scene, case.frames or scene.frames)
    events, opening, limit_before, tissue = (), None, None, None
    heavy = heaviness(scene, body, attachments, mesh.lumen_volume) if case.body.mass == "heavy" else None
    inert = heavy or Heaviness(damping=scene.damping)
    last = body = inert.of(body)
    if heavy is not None and heavy.factor == 1.0:
        warnings.warn(f"mass='heavy' makes the body no heavier than its tissue: {heavy.limit}", stacklevel=2)
    if scene.cuts:
        events, opening, mesh, tissue = cut_of(case, given, body, bool(targets))
        last, limit_before = events[-1].body, limit_of(case, body, attachments)
    limit = limit_of(case, last, events[-1].attachments if events else attachments, inert.most_damping)
    dt = case.dt_fraction * limit.damped if case.dt == "auto" else float(case.dt)
    check_size(scene.duration, frames, dt, limit, last, len(scene.obstacles) + len(attachments))
    beyond = case.beyond_limit or not case.method.capabilities.conditionally_stable
    clock = make_clock(scene.duration, frames, dt, limit, beyond)
    setup = Setup(
        body,
        case.method,
        clock,
        scene.obstacles,
        attachments,
        scene.gravity,
        inert.damping,
        inert.at_rest,
        targets=targets,
        velocity=scene.start and scene.start.velocities(body.rest),
        positions=scene.start.positions(body.rest) if scene.start and scene.start.shaped else None,
        precision=case.precision,
        events=events,
    )
    return Prepared(mesh, setup, limit, opening, limit_before, tissue, heavy)


def cut_of(
    case: Case, mesh: OrganMesh | QuadraticMesh, body: Body, targets: bool
) -> tuple[tuple[Event, ...], Opening, OrganMesh, Tissue | None]:
    """(events at which the cuts open a body on its mesh, the final Opening, the final mesh, the tissue of a body with
    virtual nodes). Raises StudyError, MassSpringError."""
    scene, recipe = case.scene, case.body
    most = frames_between(scene, case.frames or scene.frames)
    ways = [event_frames(scene, cut, most) for cut in scene.cuts]
    frames = sorted(set().union(*ways))
    shares = np.array([[_share(frame, way[0], way[-1]) for way in ways] for frame in frames])
    stages = _stages(scene, recipe, mesh, shares)
    events, last, cells = [], body, cells_of(mesh)
    for frame, stage in zip(frames, stages, strict=True):
        if stage is None:
            continue
        before, growth = last, None
        if isinstance(stage, VirtualMesh):
            last, parent, flat = body_for(scene, recipe, stage.mesh, stage.share), stage.parent, stage.mesh
        elif isinstance(recipe, SurfaceBody):
            assert isinstance(stage.mesh, OrganMesh)  # that of a quadratic body has no surface body
            pieces = surface_pieces(before, stage, recipe.axis)
            last, parent, growth = pieces.body, pieces.parent, pieces.growth
            flat = stage.mesh.outer()
        else:
            last = body_for(scene, recipe, stage.mesh)
            parent, flat = parents(cells, cells_of(stage.mesh)), flat_mesh(stage.mesh, last)
            cells = cells_of(stage.mesh)
        check_applies(case, last, targets)
        touching = stage.pairs if scene.cuts[0].contact else None  # either all cuts have contact or none
        events.append(event_of(frame, before, last, parent, attachments_for(scene, flat), touching, growth))
    check_held(scene.cuts, last, events[-1].attachments)
    whole = next(stage for stage in reversed(stages) if stage is not None)
    tissue = whole.tissue if isinstance(whole, VirtualMesh) else None
    flat, surface = (flat, last.triangles) if tissue is None else (tissue.mesh, tissue.mesh.triangles)
    return tuple(events), opening_of(events[0].frame, last, surface, whole.pairs), flat, tissue


def _share(frame: int, first: int, last: int) -> float:
    """Share of the path of a cut after `frame` frames; −1 before its first event."""
    return -1.0 if frame < first else 1.0 if frame >= last else (frame - first) / (last - first)


def _stages(
    scene: Scene, recipe: BodyRecipe, mesh: OrganMesh | QuadraticMesh, shares: np.ndarray
) -> Sequence[Opened | VirtualMesh | None]:
    """The mesh at each event, along its faces or through its cells. Raises StudyError."""
    if recipe.cut == VIRTUAL:
        assert isinstance(mesh, OrganMesh)  # the body is tetrahedral
        return [virtual_mesh(mesh, scene.cuts[0])]  # check_virtual has checked that there is only one
    return opened_in_stages(mesh, scene.cuts, shares)


def limit_of(case: Case, body: Body, attachments: tuple[Attachment, ...], damping: float | None = None) -> StepLimit:
    """The step limit of a case for a body with these attachments, with the `damping` [1/s] of the scene or another.
    Raises MassSpringError."""
    held = np.concatenate([a.nodes for a in attachments]) if attachments else None
    damping = case.scene.damping if damping is None else damping
    return step_limit(body, damping, held, case.method.added_stiffness(body))
