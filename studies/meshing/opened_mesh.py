"""The mesh of an organ after its cut: the same cells, with the faces of the cut on the boundary; and in stages, while
the cut advances."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from skfem import MeshTet, MeshTet2

from massspring import MassSpringError
from massspring.body.opening import opened
from massspring.body.quadratic import boundary_facets
from reference_fem import nodes
from reference_fem.elements.shapes import edge_index
from studies.base.errors import StudyError
from studies.geometry import OrganMesh
from studies.geometry.mesh.organ_mesh import boundary_triangles, row_keys
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.scene.cut import Cut

JUST = 1e-9
"""Tolerance over the length of the path of a front: a node that lies on the front counts as passed."""


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
    return mesh.cells if isinstance(mesh, QuadraticMesh) else mesh.tetrahedra


def opened_in_stages(mesh: OrganMesh | QuadraticMesh, cuts: Sequence[Cut], shares: np.ndarray) -> list[Opened | None]:
    """An organ's mesh opened as far as its cuts have advanced at each of e events; None for one without newly opened
    faces. shares (e, c): share of the path of each cut, not decreasing and finally 1; negative before it begins. Raises
    StudyError for a cut that does not open it."""
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
    """A second-order mesh opened along inner `faces` (f, 3), and for each of its nodes the node before, (n',). The
    first vertices are those of `mesh`, the elements keep their order. Raises StudyError."""
    try:
        opening = opened(mesh.t[:4].T, faces, mesh.nvertices)
    except MassSpringError as error:
        raise StudyError(f"a mesh of the reference is not opened by the cut: {error}") from error
    x, vertex = nodes(mesh), opening.parent
    flat = MeshTet2.from_mesh(MeshTet(np.ascontiguousarray(x[vertex].T), np.ascontiguousarray(opening.cells.T)))
    parent = np.concatenate([vertex, mesh.nvertices + edge_index(mesh, vertex[np.asarray(flat.edges).T])])
    return replace(flat, doflocs=np.ascontiguousarray(x[parent].T)), parent


def faces_in_stages(
    faces: np.ndarray, parting: np.ndarray, along: np.ndarray, shares: Sequence[float]
) -> list[np.ndarray]:
    """The faces of a cut (f, 3) that are open once its front has covered each of the ascending `shares` (s,) of its
    path, (f,) bool each; no face closes again.

    The front moves over the nodes `parting` (n,) bool, those that the whole cut doubles, in the order of their position
    `along` (n,) its direction. All faces around a node that it passes open, unless the surface of the opened body would
    touch itself in a point or an edge: then the node waits.
    """
    first, last = along[parting].min(), along[parting].max()
    passed = np.zeros(len(parting), dtype=bool)
    stages = []
    for share in shares:
        reached = parting & (along <= first + (share + JUST) * (last - first))
        passed = parted(faces, parting, passed, reached | passed)
        stages.append(passed[faces].any(axis=1))
    return stages


def parted(faces: np.ndarray, parting: np.ndarray, before: np.ndarray, reached: np.ndarray) -> np.ndarray:
    """The doubled nodes, (n,) bool: those of the stage `before` (n,), and all of those `reached` (n,) that need not
    wait."""
    while True:
        passed = reached | (parting & ~_corners(faces[~reached[faces].any(axis=1)], len(parting)))
        bad = meetings(faces, parting, passed)
        if not bad.any():
            return passed
        near = _corners(faces[bad[faces].any(axis=1)], len(parting))
        wait = near & reached & ~before
        reached = reached & ~wait if wait.any() else before


def _corners(rows: np.ndarray, n: int) -> np.ndarray:
    inside = np.zeros(n, dtype=bool)
    inside[rows] = True
    return inside


def meetings(faces: np.ndarray, parting: np.ndarray, passed: np.ndarray) -> np.ndarray:
    """Nodes at which the surface of the body would touch itself if the nodes `passed` (n,) were doubled, (n,) bool.

    In a valid state the open faces around a single node form one fan, or around a node of the outline fans that each
    begin at the outline. A side between two single nodes has at most one open face, and is not in the outline."""
    n, is_open = len(passed), passed[faces].any(axis=1)
    half = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, place, inverse, count = np.unique(row_keys(half), return_index=True, return_inverse=True, return_counts=True)
    sides, opened = half[place], np.bincount(inverse.ravel(), np.repeat(is_open, 3)).astype(int)
    # The other sides with one face are the front of the whole cut, whose nodes stay single.
    outline = (count == 1) & parting[sides].any(axis=1)
    still = ~passed[sides].any(axis=1)
    bad = np.zeros(n, dtype=bool)
    bad[sides[still & ((opened == 2) | (outline & (opened == 1)))]] = True
    corners, inner, outer = (
        np.bincount(rows.ravel(), minlength=n)
        for rows in (faces[is_open], sides[opened == 2], sides[outline & (opened == 1)])
    )
    fans = corners - inner
    of_outline = _corners(sides[outline], n)
    return bad | (~passed & np.where(of_outline, fans != outer, fans > 1))
