"""The mesh of an organ after its cut: the same cells, their faces on the cut part of the boundary."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeVar

import numpy as np
from skfem import MeshTet, MeshTet2

from massspring import MassSpringError
from massspring.body.opening import opened
from massspring.body.quadratic import boundary_facets
from reference_fem import nodes
from reference_fem.elements.shapes import edge_index
from studies.base.errors import StudyError
from studies.geometry import OrganMesh
from studies.geometry.mesh.organ_mesh import boundary_triangles
from studies.meshing.advancing_cut import faces_in_stages
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.scene.cut import Cut

Mesh = TypeVar("Mesh", OrganMesh, QuadraticMesh)


@dataclass(frozen=True, eq=False)
class Opened:
    """A mesh that was cut."""

    mesh: OrganMesh | QuadraticMesh
    """Boundary nodes first, without cuts; the cells have the order that they had."""
    parent: np.ndarray
    """For each node the one it was, (n',)."""
    pairs: np.ndarray
    """Nodes behind the cut and their copies in front of it, (p, 2)."""


def cells_of(mesh: OrganMesh | QuadraticMesh) -> np.ndarray:
    """Its tetrahedra, (k, 4) or (k, 10)."""
    return mesh.cells if isinstance(mesh, QuadraticMesh) else mesh.tetrahedra


def opened_in_stages(mesh: OrganMesh | QuadraticMesh, cut: Cut, shares: Sequence[float]) -> list[Opened | None]:
    """An organ's mesh opened as far as its cut has come after each of the ascending `shares` of its way, the last
    of which is 1; None where no face opened since the share before. Raises StudyError for a cut that does not open it.
    """
    whole = opened_mesh(mesh, cut.name)
    if cut.along is None:
        return [whole]
    faces, parting = mesh.cuts[cut.name], np.zeros(len(mesh.points), dtype=bool)
    parting[whole.parent[whole.pairs[:, 0]]] = True
    parting &= np.bincount(faces.ravel(), minlength=len(parting)) > 0  # without the nodes between corners
    stages = faces_in_stages(faces, parting, mesh.points @ np.asarray(cut.along, float), shares[:-1])
    stages.append(np.ones(len(faces), dtype=bool))
    counts = [0, *(int(chosen.sum()) for chosen in stages)]
    return [
        None if now == was else opened_mesh(mesh, cut.name, chosen)
        for chosen, (was, now) in zip(stages, pairwise(counts), strict=True)
    ]


def opened_mesh(mesh: OrganMesh | QuadraticMesh, name: str, chosen: np.ndarray | None = None) -> Opened:
    """An organ's mesh opened along its cut `name`, or the `chosen` of its faces (f,) bool; of a hollow one the surface
    of the lumen is then a part of the outer one. Raises StudyError for a cut that does not open it."""
    quadratic, faces = isinstance(mesh, QuadraticMesh), mesh.cuts[name]
    cells = cells_of(mesh)
    try:
        opening = opened(cells, faces if chosen is None else faces[chosen], len(mesh.points))
    except MassSpringError as error:
        raise StudyError(f"{mesh.name}: cut '{name}' does not open it: {error}") from error
    after = opening.cells.astype(np.int64)
    boundary = (boundary_facets(after) if quadratic else boundary_triangles(after)).astype(np.int64)
    outer = np.unique(boundary)
    order = np.concatenate([outer, np.setdiff1d(np.arange(len(opening.parent)), outer)])
    number = np.empty(len(order), np.int64)
    number[order] = np.arange(len(order))
    parent = opening.parent[order]
    same = {
        "points": mesh.points[parent],
        "surface_count": len(outer),
        "outer_count": len(outer),
        "patches": {held: np.flatnonzero(np.isin(parent, nodes)) for held, nodes in mesh.patches.items()},
        "cuts": {},
    }
    if isinstance(mesh, QuadraticMesh):
        made = replace(mesh, cells=number[after], facets=number[boundary], **same)
    else:
        made = replace(mesh, tetrahedra=number[after], triangles=number[boundary], **same)
    return Opened(made, parent, number[opening.pairs])


def opened_elements(mesh: MeshTet2, faces: np.ndarray) -> tuple[MeshTet2, np.ndarray]:
    """A second-order mesh opened along inner `faces` (f, 3), and for each of its nodes the one it was, (n',).

    The first vertices are those of `mesh`, the elements have the order that they had. Raises StudyError."""
    try:
        opening = opened(mesh.t[:4].T, faces, mesh.nvertices)
    except MassSpringError as error:
        raise StudyError(f"a mesh of the reference is not opened by the cut: {error}") from error
    x, vertex = nodes(mesh), opening.parent
    flat = MeshTet2.from_mesh(MeshTet(np.ascontiguousarray(x[vertex].T), np.ascontiguousarray(opening.cells.T)))
    parent = np.concatenate([vertex, mesh.nvertices + edge_index(mesh, vertex[np.asarray(flat.edges).T])])
    return replace(flat, doflocs=np.ascontiguousarray(x[parent].T)), parent
