"""Warnings if a body at rest deviates too much from the shape of its organ or from the area of a held region."""

import warnings
from collections.abc import Callable

import numpy as np

from massspring.world.depth import facets_within
from studies.base.errors import StudyError
from studies.geometry import OrganMesh
from studies.geometry.mesh.organ_mesh import triangle_areas
from studies.geometry.surface.sides import along_facets, region_area
from studies.meshing.bounds import ADAPTIVE_WALL, FACETS, FEW, HELD_AREA, REFUSED_AREA, SIDE
from studies.meshing.moving_tools import moments_of, moving_tools
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.meshing.rest_surface import OUTER, rest_surfaces
from studies.meshing.scene_mesh import patch_nodes
from studies.meshing.true_surface import shape_errors, true_surface
from studies.scene.inertia import top_speed
from studies.scene.kind import has_wall
from studies.scene.organ_file import remeshed
from studies.scene.scene import Held, Organ, Scene

TOUCHED = 0.6
"""Facets that touch a probe at the end over those whose rest position is inside its final position: 0.5 to 0.8 for 40
pressed livers and stomachs; in Hertz's contact half of the area."""
FINER = 1.08
"""Ratio of the numbers of vertices of successive meshes in the search for one that keeps the area of all held regions:
one mesh may cut off a held end of the organ, and the next finer one not."""


def tell_shape(scene: Scene, mesh: OrganMesh | QuadraticMesh, filled: bool) -> None:
    """Warns, in a sentence each, of a body beyond the bounds of studies.meshing.bounds. filled: whether the body is the
    tissue. Raises StudyError if the area of a held region deviates by more than REFUSED_AREA."""
    faults = []
    # Triangles of a file that is used unchanged have its exact shape.
    if remeshed(scene.organ):
        facets = mesh.facets if isinstance(mesh, QuadraticMesh) else mesh.triangles if filled else mesh.outer_triangles
        errors = shape_errors(scene.organ, rest_surfaces(mesh.points, facets), filled)
        if errors.worst > 1.0:
            faults.append(str(errors))
    for held in scene.held:
        off = 100.0 * held_area_error(scene, mesh, held)
        if abs(off) > REFUSED_AREA and remeshed(scene.organ):
            raise StudyError(
                f"{mesh.name}: the area of the held region '{held.name}' is {off:+.2g} % off that on the true surface "
                f"(allowed: {REFUSED_AREA:g} %); use more nodes"
            )
        if abs(off) > HELD_AREA:
            faults.append(f"area of the held region '{held.name}' {off:+.2g} %")
    if faults:
        flat = "" if isinstance(mesh, QuadraticMesh) else ", or quadratic elements, whose sides follow the surface"
        what = f"{mesh.name}: the body at rest does not keep the shape of its organ"
        warnings.warn(f"{what}: {', '.join(faults)}; use more nodes{flat}", stacklevel=2)


def tell_contact(scene: Scene, mesh: OrganMesh | QuadraticMesh, adaptive: bool) -> None:
    """Warns of a body, with an adaptive mesh or another, that a moving sphere or capsule touches with few facets."""
    few, enough = touched_facets(scene, mesh), ADAPTIVE_WALL if adaptive and has_wall(scene) else FACETS
    if scene.held and few is not None and few < enough:
        warnings.warn(
            f"{mesh.name}: only about {max(few, 1.0):.0f} facets will touch the probe; below {enough} its force may be "
            f"several percent off, below {FEW} tens of percent, to either side; use more nodes"
            + ("" if adaptive else ", or a quadratic body with graded='adaptive'"),
            stacklevel=2,
        )


def check_reach(scene: Scene, mesh: OrganMesh | QuadraticMesh, at_nodes: bool) -> None:
    """Refuses a body that a moving sphere or capsule is too thin for, by the facets at rest that it comes to: one
    touched `at_nodes` alone if it reaches no node, so that it slips through; one touched inside facets if most of these
    have a side of more than SIDE radii. Raises StudyError. Not where what is held moves."""
    if any(top_speed(held.path) > 0 for held in scene.held):
        return
    outer = outer_facets(mesh)
    corners = mesh.points[outer[:, :3]]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    for number, probe in moving_tools(scene):
        times = moments_of(probe)
        met = np.any([facets_within(probe, mesh.points, outer, t) for t in times], axis=0)
        if not met.any():
            continue
        long = float(np.median(sides[met])) / probe.radius
        nodes = mesh.points[np.unique(outer)]
        if at_nodes and not any(probe.gap(nodes, t).min() < 0.0 for t in times):
            why = "passes between the nodes, at which alone obstacles touch this body"
        elif not at_nodes and long > SIDE:
            why = f"is too thin for the facets under it, whose sides are {long:.2g} times as long (allowed: {SIDE:g})"
        else:
            continue
        raise StudyError(
            f"{mesh.name}: obstacle {number}, of radius {1e3 * probe.radius:.3g} mm, {why}; use more nodes, or a "
            "quadratic body with graded='adaptive'"
        )


def outer_facets(mesh: OrganMesh | QuadraticMesh) -> np.ndarray:
    """Facets of the outer surface, (f, 3 or 6)."""
    if isinstance(mesh, QuadraticMesh):
        return mesh.facets[: len(mesh.facets) - len(mesh.lumen)]
    return mesh.outer_triangles


def touched_facets(scene: Scene, mesh: OrganMesh | QuadraticMesh) -> float | None:
    """Estimated number of outer facets that a moving sphere or capsule touches where it touches most, the smallest over
    all of them; None without one."""
    probes = moving_tools(scene)
    if not probes or not scene.checkpoints:
        return None
    outer = outer_facets(mesh)
    places, _ = along_facets(mesh.points, outer)
    most = [
        max(
            int((probe.gap(places, t).reshape(len(outer), -1) < 0.0).any(axis=1).sum())
            for t in (*moments_of(probe), scene.checkpoints[-1])
            if t <= scene.checkpoints[-1]
        )
        for _, probe in probes
    ]
    return TOUCHED * min(most)


def held_area_error(scene: Scene, mesh: OrganMesh | QuadraticMesh, held: Held) -> float:
    """Area of the facets of a held region of a body over the true one, less 1 [1]; NaN as `area_error`."""
    return area_error(scene.organ, held, mesh.points, held_facets(mesh, held))


def area_error(organ: Organ, held: Held, points: np.ndarray, facets: np.ndarray) -> float:
    """Area of `facets` (f, 3 or 6) between `points` (n, 3) [m] over that of the held region on the true surface, less 1
    [1]; NaN if that is unknown, or if the region is off the surface, which the run reports."""
    truth = true_surface(organ)
    area = 0.0 if truth is None else region_area(held.region, *truth.sides[OUTER])
    if not area > 0.0:
        return float("nan")
    return float(triangle_areas(*along_facets(points, facets)).sum()) / area - 1.0


def level_that_holds(level: int, most: int, lost: Callable[[int], float], bound: float) -> int:
    """The first level from `level` to `most`, in steps by the factor FINER, with `lost(level)` of at most `bound`; if
    there is none, that with the least. Raises the first StudyError if no level can be meshed."""
    losses, failed = list[tuple[float, int]](), list[StudyError]()
    while level <= most or not (losses or failed):
        try:
            losses.append((lost(level), level))
            if losses[-1][0] <= bound:
                return level
        except StudyError as error:  # a neighbouring level may be meshable
            failed.append(error)
        level = max(level + 1, round(FINER * level))
    if not losses:
        raise failed[0]
    return min(losses)[1]


def held_facets(mesh: OrganMesh | QuadraticMesh, held: Held) -> np.ndarray:
    """The boundary facets, with three or six nodes, all of whose nodes are held and whose middle is in the region:
    between two corners of an outline a facet may lie outside with all of its nodes on it."""
    facets = mesh.facets if isinstance(mesh, QuadraticMesh) else mesh.triangles
    nodes = mesh.patches[held.name] if isinstance(mesh, QuadraticMesh) else patch_nodes(mesh, held.name, held.region)
    facets = facets[np.isin(facets, nodes).all(axis=1)]
    return facets[held.region.level(mesh.points[facets[:, :3]].mean(axis=1)) <= 0.0]
