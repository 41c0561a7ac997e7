"""Graded meshes of bodies: finer where the scene holds and touches the body, with a given number of surface nodes."""

from itertools import count

import numpy as np

from studies.base.errors import StudyError
from studies.geometry import OrganMesh
from studies.geometry.surface.node_count import FEWEST, MOST
from studies.meshing.bounds import UNDER_TOOL
from studies.meshing.held_mesh import HeldMesh, held_mesh
from studies.meshing.moving_tools import fine_under_tools
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.shaping import all_facets, linear_mesh, quadratic_mesh
from studies.meshing.true_shape import true_shape
from studies.scene.kind import load_of
from studies.scene.organ_file import remeshed
from studies.scene.scene import Scene

SOLID, HOLLOW = (1, 2), (0, 1)
"""How often elements are halved at outlines and at contacts (measured: docs/accuracy.md). The wall of a stomach is thin
everywhere, so only halving at contacts helps."""
MIDDLE, DRAWN, HUNG = 0.5, 0.4, 0.45
"""Positions of the mid-side node of a side that starts at an outline, as a share of its length from there. MIDDLE: no
shift; DRAWN: towards the outline, since displacement varies as √r near it where strains are small; HUNG: for organs
that hang by their outline, where strains are so large that 0.4 inverts elements (docs/accuracy.md). With three shifted
sides (4 share − 1)³ of the Jacobian remains at the outline, 0.22 and 0.51; below a share of 0.37 that is less than
studies.meshing.retreat allows."""
CLOSE, TOLERANCE = 0.03, 0.05
"""Deviation from the wanted number of nodes at which the search stops, and beyond which it has failed."""
TRIES, MOST_TRIES = 10, 20
"""Number of tries after which the search ends if a result is within TOLERANCE, and after which it ends in any case."""


def usual_grading(scene: Scene) -> tuple[int, int]:
    """How often elements are halved at outlines and at contacts of a scene's organ."""
    return HOLLOW if is_hollow(scene) else SOLID


def graded_mesh(
    scene: Scene, nodes: int, at_outlines: int, at_contact: int, quadratic: bool
) -> OrganMesh | QuadraticMesh:
    """The scene's organ with `nodes` nodes on its outer surface (within 5 %; mid-side nodes count), with elements
    halved `at_outlines` times at the outlines of held regions and `at_contact` times where obstacles will touch.

    A mesh file that is used unchanged keeps its number of nodes and is halved too. Raises StudyError for a mesh that
    cannot be made.
    """
    if not remeshed(scene.organ):
        return mesh_at(scene, nodes, at_outlines, at_contact, quadratic)
    # The counts hardly depend on the positions of the nodes, and evenly spread nodes are quick to compute.
    level = coarse_level(scene, nodes, at_outlines, at_contact, quadratic, even=True)
    level = coarse_level(scene, nodes, at_outlines, at_contact, quadratic, start=level)
    return mesh_at(scene, level, at_outlines, at_contact, quadratic)


def mesh_at(scene: Scene, level: int, at_outlines: int, at_contact: int, quadratic: bool) -> OrganMesh | QuadraticMesh:
    """The same from `level` vertices on the outer surface before any is halved."""
    organ_mesh, coarse, fine = halved(scene, level, at_outlines, at_contact, quadratic)
    if not quadratic:
        return linear_mesh(scene, organ_mesh, coarse, fine)
    return quadratic_mesh(scene, organ_mesh, coarse, fine, middles(scene) if at_outlines else MIDDLE)


def middles(scene: Scene) -> float:
    """Share at which mid-side nodes of sides that start at an outline of the scene's held regions are placed (see
    DRAWN)."""
    if not scene.held and not scene.cuts:
        return MIDDLE
    return HUNG if load_of(scene) == "sag" else DRAWN


def halved(
    scene: Scene, level: int, at_outlines: int, at_contact: int, on_shape: bool = False, even: bool = False
) -> tuple[OrganMesh, HeldMesh, HeldMesh]:
    """The organ's mesh, its HeldMesh, and the halved HeldMesh, all with straight sides. `on_shape` and `even` as in
    studies.meshing.scene_mesh.mesh_for."""
    organ_mesh = mesh_for(scene, level, layers=1 if is_hollow(scene) else None, on_shape=on_shape, even=even)
    coarse = held_mesh(scene, organ_mesh)
    fine = coarse.refined(scene, at_outlines, at_contact)
    if at_contact > 0:
        fine = fine_under_tools(scene, fine, UNDER_TOOL)
    return organ_mesh, coarse, coarse if fine.mesh.nelements == coarse.mesh.nelements else fine


def is_hollow(scene: Scene) -> bool:
    if scene.organ.shape == "file":
        return "wall" in scene.organ.parameters
    shape = true_shape(scene.organ)
    return shape is not None and shape.wall is not None


def coarse_level(
    scene: Scene,
    nodes: int,
    at_outlines: int,
    at_contact: int,
    quadratic: bool,
    start: int | None = None,
    even: bool = False,
) -> int:
    """Number of surface vertices before halving that leads to `nodes` nodes on the outer surface, near `start` if
    given; `even`: for a mesh with evenly spread nodes. Raises StudyError."""
    check_number(scene, nodes, quadratic)
    counts: dict[int, int] = {}
    level, failed = start or max(FEWEST, (nodes + 6) // 4 if quadratic else nodes), None
    for tried in range(MOST_TRIES):
        if tried >= TRIES and (not counts or _off(counts, nodes) <= TOLERANCE):
            break
        try:
            body = halved(scene, level, at_outlines, at_contact, quadratic, even)[2]
            counts[level] = outer_nodes(body, quadratic)
        except StudyError as error:
            failed = failed or error  # raised below, unless a neighbouring level can be meshed
            level += max(1, level // 50)
            continue
        off = abs(counts[level] / nodes - 1.0)
        level = max(FEWEST, round(level * nodes / counts[level]))
        if off <= CLOSE or (level in counts and _off(counts, nodes) <= TOLERANCE):
            break
        if level in counts:  # the nearest that was not tried, since the resulting number of nodes varies irregularly
            step = max(1, level // 50)
            near = (level + sign * k * step for k in count(1) for sign in (1, -1))
            level = next(other for other in near if other >= FEWEST and other not in counts)
    if failed is not None and not counts:
        raise failed
    best = min(counts, key=lambda tried: abs(counts[tried] - nodes))
    if _off(counts, nodes) > TOLERANCE:
        raise StudyError(
            f"scene '{scene.name}': no graded mesh has {nodes} surface nodes; ask for {counts[best]}, the nearest found"
        )
    return best


def check_number(scene: Scene, nodes: object, quadratic: bool) -> None:
    most = 4 * MOST - 6 if quadratic else MOST
    if isinstance(nodes, bool) or not isinstance(nodes, int | np.integer) or not FEWEST <= nodes <= most:
        raise StudyError(
            f"scene '{scene.name}': {nodes!r} surface nodes asked for; give a whole number from {FEWEST} to {most}"
        )


def _off(counts: dict[int, int], nodes: int) -> float:
    return min(abs(count / nodes - 1.0) for count in counts.values())


def outer_nodes(body: HeldMesh, quadratic: bool) -> int:
    """Number of nodes on the outer surface, including mid-side nodes if there are any."""
    facets = all_facets(body)[-2]
    return len(set((facets if quadratic else facets[:, :3]).ravel().tolist()))
