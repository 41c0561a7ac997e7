"""The mesh of an organ after its cut: the same cells, their faces on the cut part of the boundary."""

from dataclasses import dataclass, replace
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
from studies.meshing.quadratic_mesh import QuadraticMesh

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


def opened_mesh(mesh: OrganMesh | QuadraticMesh, name: str) -> Opened:
    """A solid organ's mesh opened along its cut `name`. Raises StudyError for a cut that does not open it."""
    quadratic = isinstance(mesh, QuadraticMesh)
    cells = mesh.cells if quadratic else mesh.tetrahedra
    try:
        opening = opened(cells, mesh.cuts[name], len(mesh.points))
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
