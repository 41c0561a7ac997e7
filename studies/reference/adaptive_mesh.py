"""Adaptive meshes of bodies: one solution of the coarse body with reference elements shows where a scene needs small
elements.

With halvings set by hand the error depends on chance: with few facets in contact the force has a wrong direction,
which, by the lever to the held region, turns the whole organ (docs/accuracy.md).
"""

import math
import warnings
from dataclasses import replace

import numpy as np

from massspring.sources import source_fingerprint
from reference_fem import Checkpoint, NewtonSettings, SolveError, equilibrium_path, nodes
from reference_fem.estimate import stress_indicator
from reference_fem.system.saddle_point import System
from studies.base.errors import StudyError
from studies.geometry import OrganMesh
from studies.geometry.mesher.jobs import cached
from studies.geometry.surface.node_count import FEWEST
from studies.meshing.bounds import HELD_AREA, UNDER_TOOL
from studies.meshing.graded_mesh import check_number, halved, is_hollow, middles, outer_nodes
from studies.meshing.held_mesh import HeldMesh
from studies.meshing.kept_shape import held_area_error, level_that_holds
from studies.meshing.moving_tools import fine_under_tools
from studies.meshing.nested_mesh import edges_of, marked
from studies.meshing.opened_mesh import opened_elements
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.meshing.reference_mesh import on_true_sides
from studies.meshing.shaping import quadratic_mesh
from studies.reference.problem import problem_on
from studies.scene.as_json import scene_to_json
from studies.scene.kind import NOT_ADAPTIVE, load_of
from studies.scene.organ_file import remeshed
from studies.scene.scene import Scene

SOLID, HOLLOW = 0.7, 0.8
"""Nodes of the coarse body over those of the adapted one (measured: docs/accuracy.md)."""
MOST = 0.95
"""Largest such ratio, if a finer coarse mesh is needed to keep the area of all held regions."""
LOOSE = NewtonSettings(force_tol=1e-4, penetration_tol=1e-3)
"""Tolerances that are sufficient to rank elements."""
STRAIN = 1.0
"""Largest predicted stretch minus 1 of an element at an outline. There it grows as 1/√h as elements shrink, until they
are inverted (measured: docs/accuracy.md)."""
AT_REST = 1e-6
"""Largest stretch minus 1 of a body that nothing deforms: round-off."""
STEP = 1.25
"""Factor by which the number of elements grows until there are enough surface nodes."""


def adaptive_mesh(scene: Scene, number: int) -> QuadraticMesh:
    """The scene's organ in quadratic tetrahedra with `number` nodes on its outer surface or a few more, mid-side nodes
    among them: of a mesh with a share of them, elements are halved, those with the largest error indicator first.

    A mesh file that is used unchanged is the coarse mesh itself. The wall of a hollow organ has one layer.
    Raises StudyError for a scene without a static load or without a held region, for a mesh that cannot be made, and
    where the coarse body has no equilibrium.
    """
    reason = why_not(scene)
    if reason is not None:
        raise StudyError(f"scene '{scene.name}' has no adaptive bodies: {reason}; choose graded=True")
    check_number(scene, number, quadratic=True)
    organ_mesh, whole = coarse_mesh(scene, number)
    coarse = fine_under_tools(scene, whole, UNDER_TOOL)
    few = outer_nodes(coarse, quadratic=True)
    if few > number:
        raise StudyError(f"scene '{scene.name}': its coarse mesh has {few} surface nodes already; ask for more")
    recipe = {
        "kind": "indicator",
        "name": f"indicator-{scene.organ.shape}",
        "code": source_fingerprint(__name__),
        "scene": scene_to_json(replace(scene, name="", title="", reference=None)),
    }
    shape = {"points": organ_mesh.points, "tetrahedra": organ_mesh.tetrahedra}
    names = "indicator", "stretch"
    arrays = cached(
        recipe, shape, names, lambda: dict(zip(names, indicators_of(scene, organ_mesh, whole, coarse), strict=True))
    )
    fine = adapted(coarse, arrays["indicator"], number, least_edge(coarse, arrays["stretch"]))
    return quadratic_mesh(scene, organ_mesh, whole, fine, middles(scene))


def coarse_mesh(scene: Scene, number: int) -> tuple[OrganMesh, HeldMesh]:
    """The organ's mesh with a share of `number` nodes on its outer surface, mid-side nodes among them, or with a larger
    share if that mesh loses area of a held region; the best one if all do."""
    share = HOLLOW if is_hollow(scene) else SOLID
    level = max(FEWEST, round((share * number + 6) / 4))
    if remeshed(scene.organ):
        most = int((MOST * number + 6) / 4)
        level = level_that_holds(level, most, lambda tried: lost_area(scene, tried), HELD_AREA)
    organ_mesh, coarse, _ = halved(scene, level, 0, 0)
    return organ_mesh, coarse


def lost_area(scene: Scene, level: int) -> float:
    """The largest error of the area of a held region [%] of quadratic elements on the mesh with `level` vertices on
    the outer surface that will be halved; 0 if the true area is unknown."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # warnings of the chosen mesh come later
        organ_mesh, coarse, _ = halved(scene, level, 0, 0)
        mesh = quadratic_mesh(scene, organ_mesh, coarse, coarse, middles(scene))
    errors = [abs(held_area_error(scene, mesh, held)) for held in scene.held]
    return 100.0 * max((error for error in errors if error == error), default=0.0)


def why_not(scene: Scene) -> str | None:
    """Why a scene cannot have adaptive bodies; None if it can."""
    if not scene.held:
        return "nothing holds the organ, so the reference elements have no unique solution"
    return NOT_ADAPTIVE.get(load_of(scene))


def indicators_of(
    scene: Scene, organ_mesh: OrganMesh, whole: HeldMesh, coarse: HeldMesh
) -> tuple[np.ndarray, np.ndarray]:
    """Error indicator over its largest value, and largest principal stretch of the corners, both (ne,), of the elements
    of the coarse body, parts of those of `whole`, at the last checkpoint; the body is opened along the scene's cuts.

    Raises StudyError if no equilibrium is found, or one without deformation."""
    try:
        mesh = on_true_sides(scene, organ_mesh, whole, coarse)
        *held, wall = coarse.facets(mesh)
        middle = nodes(mesh)[wall[:, :3]].mean(axis=1)
        patches = [np.unique(facets) for facets in held]
        if scene.cuts:  # strains are large around the front of a cut
            mesh, parent = opened_elements(mesh, coarse.cut_faces)
            patches = [np.flatnonzero(np.isin(parent, patch)) for patch in patches]
        problem = problem_on(scene, mesh, patches, middle if scene.filled_at(math.inf) else None)
        ends = list[Checkpoint]()
        equilibrium_path(problem, scene.checkpoints[-1:] or (scene.duration,), LOOSE, on_checkpoint=ends.append)
    except SolveError as error:
        raise StudyError(
            f"scene '{scene.name}': the coarse body has no solution by which to adapt ({error}); choose graded=True"
        ) from error
    x = ends[-1].state.x
    indicator, rest = stress_indicator(System(problem, LOOSE), x), nodes(problem.mesh)
    corners = problem.mesh.t[:4].T
    before, after = (np.diff(at[corners], axis=1) for at in (rest, rest + x[: rest.size].reshape(-1, 3)))
    gradient = np.linalg.solve(before, after)  # rows are edges, so this is the deformation gradient transposed
    stretch = np.linalg.svd(gradient, compute_uv=False)[:, 0]
    if not stretch.max() > 1.0 + AT_REST:
        raise StudyError(
            f"scene '{scene.name}': the coarse body by which to adapt is not deformed at the last checkpoint; end with "
            "a checkpoint under load, or choose graded=True"
        )
    return indicator / indicator.max(), stretch


def least_edge(coarse: HeldMesh, stretch: np.ndarray) -> float:
    """The shortest edge [m] of an element at an outline whose stretch less 1 stays below STRAIN: near an outline it
    goes as r^-1/2, so an element of edge h with `stretch` (ne,) may shrink to h ((stretch − 1)/STRAIN)²."""
    there = coarse.at_outlines()
    edge = edges_of(coarse.mesh.p.T, coarse.mesh.t.T[there])
    return float((edge * ((stretch[there] - 1.0) / STRAIN) ** 2).max(initial=0.0))


def adapted(coarse: HeldMesh, indicator: np.ndarray, number: int, least: float = 0.0) -> HeldMesh:
    """`coarse` with elements halved, largest indicator (ne,) first, until there are `number` nodes on the outer
    surface; at outlines none to edges shorter than `least` [m]."""
    few, many, body = 0, coarse.mesh.nelements, coarse
    while outer_nodes(body, quadratic=True) < number:
        few, many = many, round(STEP * many)
        body = marked(coarse, indicator, many, least)[0]
        if body.mesh.nelements <= few:
            raise StudyError(f"no element is left to halve, and the mesh has fewer than {number} nodes; ask for fewer")
    # The smallest sufficient number of elements, to within 1 %.
    while few and many - few > max(1, many // 100):
        middle = (few + many) // 2
        tried = marked(coarse, indicator, middle, least)[0]
        if outer_nodes(tried, quadratic=True) < number:
            few = middle
        else:
            many, body = middle, tried
    return body
