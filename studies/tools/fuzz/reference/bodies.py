"""Meshes of the reference's trials, sound and broken."""

from dataclasses import replace

import numpy as np
from skfem import MeshTet, MeshTet2

from reference_fem.elements.shapes import facet_nodes, nodes
from reference_fem.oracles.bodies import ball_octant, shell_octant, straight
from studies.geometry import organ
from studies.tools.fuzz.bodies import ORGAN_NODES, RADIUS, cloud
from studies.tools.fuzz.reference.trial import SHELL, ReferenceTrial
from studies.tools.fuzz.trial import ORGANS

INNER = 0.6
"""Radius of a shell's lumen over its outer one."""


def mesh_of(trial: ReferenceTrial) -> MeshTet:
    """The mesh of a trial, straight or curved. Raises StudyError for an organ that cannot be made."""
    rng = np.random.default_rng((trial.seed, trial.number, 19))
    mesh = _sound(trial, rng)
    mesh = FLAW[trial.flaw](mesh) if trial.flaw in FLAW else mesh
    return _bent(mesh, trial.bend, rng) if trial.bend > 0.0 and trial.flaw != "unused" else mesh


def _sound(trial: ReferenceTrial, rng: np.random.Generator) -> MeshTet:
    size = 1 + trial.nodes % 3
    if trial.shape in ORGANS:
        body = organ(trial.shape, ORGAN_NODES[0])
        return tetrahedra(body.points, body.tetrahedra)
    if trial.shape == "octant":
        return _scaled(ball_octant(size))
    if trial.shape == SHELL:
        body = shell_octant(INNER, 2 + trial.nodes % 2, size - size // 3)
        return _scaled(body if trial.nodes % 2 else straight(body))
    if trial.shape == "box":
        ends = [np.sort([0.0, *rng.random(1 + size // 2), 1.0]) for _ in range(3)]
        return _scaled(MeshTet.init_tensor(*ends))
    points, cells = cloud(rng, trial.nodes, trial.shape == "sliver")
    if trial.shape == "two":
        other, more = cloud(rng, trial.nodes)
        points, cells = np.vstack([points, other + 3 * RADIUS * np.eye(3)[2]]), np.vstack([cells, more + len(points)])
    return tetrahedra(points, cells)


def tetrahedra(points: np.ndarray, cells: np.ndarray) -> MeshTet:
    """A straight mesh of points (n, 3) [m] and cells (k, 4)."""
    return MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T.astype(np.int64)))


def _scaled(mesh: MeshTet) -> MeshTet:
    return replace(mesh, doflocs=RADIUS * mesh.doflocs)


def _bent(mesh: MeshTet, bend: float, rng: np.random.Generator) -> MeshTet2:
    """With the mid-side nodes of its surface moved at random by up to `bend` of their edges."""
    points, table = nodes(mesh).copy(), facet_nodes(mesh)
    middles = np.unique(table[:, 3:])
    ends = np.asarray(mesh.edges)[:, middles - mesh.nvertices]
    length = np.linalg.norm(points[ends[0]] - points[ends[1]], axis=1, keepdims=True)
    points[middles] += bend * length * rng.uniform(-1.0, 1.0, (len(middles), 3))
    curved = mesh if isinstance(mesh, MeshTet2) else MeshTet2.from_mesh(mesh)
    return replace(curved, doflocs=points.T)


def _inside_out(mesh: MeshTet) -> MeshTet:
    """A vertex pulled through the face on its other side."""
    points = mesh.doflocs.copy()
    first, others = mesh.t[0, 0], mesh.t[1:4, 0]
    points[:, first] += 2.5 * (points[:, others].mean(axis=1) - points[:, first])
    return replace(mesh, doflocs=points)


def _flat(mesh: MeshTet) -> MeshTet:
    points = mesh.doflocs.copy()
    points[:, mesh.t[0, 0]] = points[:, mesh.t[1:4, 0]].mean(axis=1)
    return replace(mesh, doflocs=points)


def _open(mesh: MeshTet) -> MeshTet:
    """Without its middle element."""
    return tetrahedra(mesh.p[:, : mesh.nvertices].T, np.delete(mesh.t[:4], mesh.t.shape[1] // 2, axis=1).T)


def _unused(mesh: MeshTet) -> MeshTet:
    """With a vertex that no element uses."""
    return tetrahedra(np.vstack([mesh.p[:, : mesh.nvertices].T, np.full(3, RADIUS)]), mesh.t[:4].T)


def _not_finite(mesh: MeshTet) -> MeshTet:
    points = mesh.doflocs.copy()
    points[2, mesh.t[0, 0]] = np.nan
    return replace(mesh, doflocs=points)


FLAW = {
    "inside_out": _inside_out,
    "flat": _flat,
    "open": _open,
    "unused": _unused,
    "not_finite": _not_finite,
}
