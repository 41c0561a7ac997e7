"""The mesh of an organ after its cut: the same cells, with the faces of the cut on the boundary."""

from collections.abc import Mapping, Sequence
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
    """The opened mesh: boundary nodes first, `cuts` empty, cells in the same order as before."""
    parent: np.ndarray
    """For each node its node before the cut, (n',)."""
    pairs: np.ndarray
    """Nodes behind the cut and their copies in front of it, (p, 2)."""


def cells_of(mesh: OrganMesh | QuadraticMesh) -> np.ndarray:
    """Its tetrahedra, (k, 4) or (k, 10)."""
    return mesh.cells if isinstance(mesh, QuadraticMesh) else mesh.tetrahedra


def opened_in_stages(mesh: OrganMesh | QuadraticMesh, cuts: Sequence[Cut], shares: np.ndarray) -> list[Opened | None]:
    """An organ's mesh opened as far as its cuts have advanced at each of e events; None for an event without newly
    opened faces. shares (e, c): share of the path of each cut, not decreasing and finally 1; negative before it begins.

    Raises StudyError for a cut that does not open it."""
    whole = opened_mesh(mesh)
    parting = np.zeros(len(mesh.points), dtype=bool)
    parting[whole.parent[whole.pairs[:, 0]]] = True
    ways = {cut.name: _on_the_way(mesh, cut, parting, way) for cut, way in zip(cuts, shares.T, strict=True)}
    stages = [{name: mesh.cuts[name][way[k]] for name, way in ways.items()} for k in range(len(shares))]
    counts = [0, *(sum(map(len, faces.values())) for faces in stages)]
    return [
        None if now == was else whole if now == counts[-1] else opened_mesh(mesh, faces)
        for faces, (was, now) in zip(stages, pairwise(counts), strict=True)
    ]


def _on_the_way(mesh: OrganMesh | QuadraticMesh, cut: Cut, parting: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Which faces of a cut are open at each share (e,) of its path, (e, f) bool; `parting` (n,) bool: the nodes that
    all cuts double."""
    faces = mesh.cuts[cut.name]
    opens = np.repeat((shares >= 0)[:, None], len(faces), axis=1)
    moves = (shares >= 0) & (shares < 1)
    if cut.along is not None and moves.any():
        parting = parting & (np.bincount(faces.ravel(), minlength=len(parting)) > 0)  # none between corners
        way = mesh.points @ np.asarray(cut.along, float)
        opens[moves] = faces_in_stages(faces, parting, way, shares[moves].tolist())
    return opens


def opened_mesh(mesh: OrganMesh | QuadraticMesh, along: Mapping[str, np.ndarray] | None = None) -> Opened:
    """An organ's mesh opened along faces (f, 3) of its cuts by name (None: all of them); for a hollow organ the surface
    of the lumen is then part of the outer surface. Raises StudyError for a cut that does not open it."""
    along = mesh.cuts if along is None else along
    quadratic, cells = isinstance(mesh, QuadraticMesh), cells_of(mesh)
    try:
        opening = opened(cells, np.concatenate(list(along.values())), len(mesh.points))
    except MassSpringError as error:
        names = "' or '".join(along)
        raise StudyError(f"{mesh.name}: cut '{names}' does not open it: {error}") from error
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
        made = replace(mesh, cells=number[after], facets=number[boundary], lumen=mesh.lumen[:0], **same)
    else:
        made = replace(mesh, tetrahedra=number[after], triangles=number[boundary], **same)
    return Opened(made, parent, number[opening.pairs])


def opened_elements(mesh: MeshTet2, faces: np.ndarray) -> tuple[MeshTet2, np.ndarray]:
    """A second-order mesh opened along inner `faces` (f, 3), and for each of its nodes the node before, (n',).

    The first vertices are those of `mesh`, the elements keep their order. Raises StudyError."""
    try:
        opening = opened(mesh.t[:4].T, faces, mesh.nvertices)
    except MassSpringError as error:
        raise StudyError(f"a mesh of the reference is not opened by the cut: {error}") from error
    x, vertex = nodes(mesh), opening.parent
    flat = MeshTet2.from_mesh(MeshTet(np.ascontiguousarray(x[vertex].T), np.ascontiguousarray(opening.cells.T)))
    parent = np.concatenate([vertex, mesh.nvertices + edge_index(mesh, vertex[np.asarray(flat.edges).T])])
    return replace(flat, doflocs=np.ascontiguousarray(x[parent].T)), parent
