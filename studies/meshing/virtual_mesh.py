"""The mesh of an organ cut by virtual nodes: copies of cells, which move, and the tissue in them, which is recorded."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array, csr_array

from massspring import MassSpringError
from massspring.body.springs import EDGES_OF_TETRAHEDRON
from massspring.body.virtual_nodes import VirtualNodes, virtual_nodes
from studies.base.errors import StudyError
from studies.geometry import OrganMesh
from studies.geometry.mesh.clipped import covered_part, crossing_edges, crossings, divided
from studies.geometry.mesh.organ_mesh import mean_edge, surface_first
from studies.scene.cut import Cut

NEAR = 1e-4
"""Distance of the sheet of a cut from every node, over the mean edge; the sheet bends slightly where a node is
nearer."""


@dataclass(frozen=True, eq=False)
class Tissue:
    """The tissue in the copies: the cells divided at the sheet, with points interpolated between the nodes of a
    body."""

    mesh: OrganMesh
    """Mesh of the tissue at rest; nodes on the two faces of the cut coincide."""
    between: csr_array
    """Weights of the nodes of the body in each point, (p, n')."""
    pairs: np.ndarray
    """Points behind the cut and in front of it, (q, 2)."""

    def places(self, x: np.ndarray) -> np.ndarray:
        """Positions of its points for a body with nodes at `x` (…, n', 3) [m], (…, p, 3)."""
        return np.array([self.between @ one for one in x]) if x.ndim == 3 else self.between @ x


@dataclass(frozen=True, eq=False)
class VirtualMesh:
    """A mesh that is cut along a sheet that its faces do not follow."""

    mesh: OrganMesh
    """The copies as cells; triangles and patches are those before the cut, with the same node numbers."""
    share: np.ndarray
    """Part of each cell that is tissue, (k,)."""
    parent: np.ndarray
    """For each node the one it was, (n',)."""
    tissue: Tissue

    @property
    def pairs(self) -> np.ndarray:
        """Points of the tissue behind the cut and in front of it, (q, 2); they are not nodes of the body."""
        return self.tissue.pairs


def virtual_mesh(mesh: OrganMesh, cut: Cut) -> VirtualMesh:
    """The mesh of a solid organ, made without regard to the cut, cut with virtual nodes. Raises StudyError if that is
    not possible."""
    cells, points = mesh.tetrahedra.astype(np.int64), mesh.points
    level, normal = cut.plane.level(points), np.asarray(cut.plane.normal, float) / np.linalg.norm(cut.plane.normal)
    least = NEAR * mean_edge(points, mesh.triangles)
    level = np.where(np.abs(level) < least, np.where(level < 0, -least, least), level)

    def covers(places: np.ndarray) -> np.ndarray:
        return np.ones(len(places), bool) if cut.within is None else cut.within.level(places) < 0

    parted = covers(points - level[:, None] * normal)
    try:
        copies = virtual_nodes(cells, level, parted, covered_part(points, cells, level, covers))
    except MassSpringError as error:
        raise StudyError(f"{mesh.name}: cut '{cut.name}' does not open it: {error}") from error
    after = replace(mesh, points=points[copies.parent], tetrahedra=copies.cells.astype(np.int64))
    return VirtualMesh(after, copies.share, copies.parent, _tissue(mesh, level, copies))


def _tissue(mesh: OrganMesh, level: np.ndarray, copies: VirtualNodes) -> Tissue:
    """The cells of `mesh` divided at the sheet, where `level` (n,) is 0: points on crossing edges move with the copies
    on their side."""
    cells, points, n = mesh.tetrahedra.astype(np.int64), mesh.points, len(mesh.points)
    edges = crossing_edges(cells, level)
    along, at = crossings(points, level, edges)
    front, behind = (_ends_on(side, cells, level, edges, copies) for side in (1, -1))
    parted = (front != behind).any(axis=1)
    pieces, side = divided(points, cells, level, edges)
    of_side = np.array([n + np.arange(len(edges)), n + np.arange(len(edges))])
    of_side[1, parted] = n + len(edges) + np.arange(int(parted.sum()))
    on_edge = pieces >= n
    pieces[on_edge] = of_side[np.where(side > 0, 1, 0)[:, None].repeat(4, axis=1)[on_edge], pieces[on_edge] - n]
    whole = cells[np.ptp(np.sign(level[cells]), axis=1) == 0]
    places = np.concatenate([points, at, at[parted]])
    ends, share = np.concatenate([behind, front[parted]]), np.concatenate([along, along[parted]])
    rows = np.concatenate([np.arange(n), n + np.arange(len(ends)), n + np.arange(len(ends))])
    values = np.concatenate([np.ones(n), 1.0 - share, share])
    columns = np.concatenate([np.arange(n), ends[:, 0], ends[:, 1]])
    between = coo_array((values, (rows, columns)), shape=(len(places), len(copies.parent))).tocsr()
    _, triangles, tetrahedra, count = surface_first(places, np.concatenate([whole, pieces]))
    order = np.empty(len(places), np.int64)
    order[tetrahedra.ravel()] = np.concatenate([whole, pieces]).ravel()
    number = np.argsort(order)
    shown = replace(
        mesh,
        points=places[order],
        triangles=triangles,
        tetrahedra=tetrahedra,
        surface_count=count,
        outer_count=count,
        patches={held: number[nodes] for held, nodes in mesh.patches.items()},
    )
    pairs = number[of_side[:, parted].T]
    return Tissue(shown, csr_array(between[order]), pairs)


def _ends_on(side: int, cells: np.ndarray, level: np.ndarray, edges: np.ndarray, copies: VirtualNodes) -> np.ndarray:
    """The nodes of the body between which the point on each crossing edge is interpolated on one side, (e, 2): those of
    the edge, or of the copies around it."""
    ends, n = edges.copy(), len(level)
    own = copies.side == side
    before = cells[copies.cell[own]][:, EDGES_OF_TETRAHEDRON].reshape(-1, 2)
    after = copies.cells[own].astype(np.int64)[:, EDGES_OF_TETRAHEDRON].reshape(-1, 2)
    crossing = (level[before] > 0).sum(axis=1) == 1
    before, after = before[crossing], after[crossing]
    turned = level[before[:, 0]] < 0
    before[turned], after[turned] = before[turned][:, ::-1], after[turned][:, ::-1]
    place = np.searchsorted(edges @ [n, 1], before @ [n, 1])
    first, at = np.unique(place, return_index=True)
    ends[first] = after[at]
    return ends
