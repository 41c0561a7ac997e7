"""Taylor and Hood's P2/P1 elements on one mesh: their unknowns, reference tables and geometry, from scikit-fem."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from skfem import ElementTetP1, ElementTetP2, ElementTriP2, MeshTet, MeshTet2
from skfem.assembly import Dofs
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet, RefTri

from reference_fem.errors import SolveError

ORDER = 5
"""Degree that is integrated exactly: the lowest with positive weights that keeps the rates, and at least 4, which p J
needs."""
FACET_EDGES = ((0, 1), (1, 2), (0, 2))
"""Vertex pairs of the mid-side nodes 3, 4, 5 of a six-node triangle."""


class Sizes(NamedTuple):
    """Lengths as tuples of zeros: the compiler knows the length of a tuple, not that of an array, and can unroll loops.

    Pass them to inner functions one by one: both together slow the assembly by a fifth.
    """

    functions: tuple
    """nu displacement functions, 10."""
    pressures: tuple
    """np pressure functions, 4."""


class Elements(NamedTuple):
    """Tables for the element kernel: `ne` elements with `nq` quadrature points each.

    A local vector has u_x at the `nu` functions, then u_y, u_z, then p at the `np` functions.
    """

    dofs: np.ndarray
    """Global unknown of each local one, (ne, 3 nu + np) uint32."""
    gradients: np.ndarray
    """Rest gradients of the displacement functions, (ne, nq, 3, nu) [1/m]."""
    pressures: np.ndarray
    """Values of the pressure functions, (nq, np)."""
    weights: np.ndarray
    """Rest volume of each quadrature point, (ne, nq) [m³]."""
    sizes: Sizes


class Facets(NamedTuple):
    """Boundary facets, turned outward, for `nf` facets and `nq` points each."""

    nodes: np.ndarray
    """Three vertices, then the mid-side nodes of FACET_EDGES, (nf, 6)."""
    values: np.ndarray
    """Values of the six functions, (nq, 6)."""
    slopes: np.ndarray
    """Their two derivatives, (nq, 2, 6)."""
    weights: np.ndarray
    """Rest area of each quadrature point, (nf, nq) [m²]."""


def basis_table(element: Any, points: np.ndarray):
    """Values (nq, nb) and gradients (nq, dim, nb) of a scikit-fem element at points (dim, nq)."""
    count = element.doflocs.shape[0]
    pairs = [element.lbasis(points, i) for i in range(count)]
    values = np.stack([np.broadcast_to(v, points.shape[1:]) for v, _ in pairs], axis=1)
    gradients = np.stack([np.asarray(g, dtype=float).T for _, g in pairs], axis=2)
    return values, gradients


def element_nodes(mesh: MeshTet):
    """P2 nodes of every tetrahedron, (ne, 10): four vertices, then six mid-side nodes."""
    return Dofs(mesh, ElementTetP2()).element_dofs.T


def nodes(mesh: MeshTet) -> np.ndarray:
    """Rest positions of the P2 nodes, (N2, 3) [m]: the vertices, then the edges' mid-side nodes."""
    if mesh.doflocs.shape[1] > mesh.nvertices:
        return np.ascontiguousarray(mesh.doflocs.T)
    middles = mesh.p[:, mesh.edges].mean(axis=1)
    return np.ascontiguousarray(np.hstack((mesh.p, middles)).T)


def build_elements(mesh: MeshTet, order: int) -> Elements:
    """Tables of every element; raises SolveError for folded or flat elements.

    order: degree that the quadrature integrates exactly; P2 displacements enter J as a cubic and p J as a quartic.
    """
    points, w = get_quadrature(RefTet, order)
    _, shape = basis_table(ElementTetP2(), points)
    table = element_nodes(mesh)
    jacobian = np.einsum("eni,qJn->eqiJ", nodes(mesh)[table], shape)
    det = np.linalg.det(jacobian)
    check_shapes(det)
    gradients = np.einsum("eqJi,qJn->eqin", np.linalg.inv(jacobian), shape)
    dofs = np.hstack([*(3 * table + c for c in range(3)), 3 * (table.max() + 1) + mesh.t[:4].T]).astype(np.uint32)
    pressures, _ = basis_table(ElementTetP1(), points)
    sizes = Sizes((0,) * table.shape[1], (0,) * pressures.shape[1])
    return Elements(dofs, np.ascontiguousarray(gradients), pressures, np.abs(det) * w, sizes)


def check_shapes(det: np.ndarray):
    """Raises SolveError for elements whose map folds: the sign of det (ne, nq) must not change inside one element."""
    largest = np.abs(det).max(axis=1)
    folded = det.min(axis=1) * det.max(axis=1) <= 0.0
    # 1e-10 of the typical size is far below what a meshing tool leaves and far above round-off
    bad = np.flatnonzero(folded | (largest < 1e-10 * np.median(largest)))
    if bad.size:
        raise SolveError(
            f"element {bad[0]} is inverted or flat at rest ({bad.size} such elements; smallest volume ratio "
            f"{(det.min(axis=1) * np.sign(det.mean(axis=1)) / largest)[bad[0]]:.1e}, limit > 0): mend the mesh, "
            f"or leave its mid-side nodes straight"
        )


OUTWARD = np.array([-1, 1, -1, 1])
"""+1 for faces of a positive tetrahedron whose vertices, in the order of RefTet, are counterclockwise from outside,
else -1."""


def check_neighbours(mesh: MeshTet):
    """Raises SolveError for folded or inverted elements: neighbours must pass round their common face in opposite
    senses.

    The orientation is that of the map of an element, not of its corners: a part of a halved curved element may have
    inverted corners although its map is positive everywhere.
    """
    _, shape = basis_table(ElementTetP2(), get_quadrature(RefTet, ORDER)[0])
    det = np.linalg.det(np.einsum("eni,qJn->eqiJ", nodes(mesh)[element_nodes(mesh)], shape))
    check_shapes(det)
    sign = np.sign(det[:, 0])
    a, b, c = np.asarray(mesh.t[:4], np.int64)[np.array(RefTet.facets)].transpose(1, 0, 2)
    turns = np.sign((b - a) * (c - a) * (c - b)) * OUTWARD[:, None] * sign
    round_face = np.zeros(mesh.nfacets)
    np.add.at(round_face, np.asarray(mesh.t2f), turns)
    bad = np.flatnonzero((mesh.f2t[1] >= 0) & (round_face != 0.0))
    if bad.size:
        pair = mesh.f2t[:, bad[0]]
        raise SolveError(
            f"elements {pair[0]} and {pair[1]} overlap across their common face ({bad.size} such faces, limit 0): "
            f"one of them is inverted, repair the mesh"
        )


def facet_nodes(mesh: MeshTet) -> np.ndarray:
    """Six nodes of every boundary facet, outward, (nf, 6)."""
    index = mesh.boundary_facets()
    corners = np.asarray(mesh.facets)[:, index].T.copy()
    owner = mesh.t[:4, np.asarray(mesh.f2t)[0, index]].T
    opposite = owner.sum(axis=1) - corners.sum(axis=1)
    a, b, c, d = (mesh.p[:, i].T for i in (*corners.T, opposite))
    inward = np.einsum("fi,fi->f", np.cross(b - a, c - a), d - a) > 0.0
    corners[inward] = corners[inward][:, [0, 2, 1]]
    middles = [mesh.nvertices + edge_index(mesh, corners[:, pair]) for pair in FACET_EDGES]
    return np.column_stack((corners, *middles))


def edge_index(mesh: MeshTet, pairs: np.ndarray):
    """Rows of mesh.edges that join the vertex pairs (n, 2)."""
    count = mesh.nvertices
    edges = np.asarray(mesh.edges)
    keys = np.min(edges, axis=0) * np.int64(count) + np.max(edges, axis=0)
    order = np.argsort(keys)
    pair_keys = np.min(pairs, axis=1) * np.int64(count) + np.max(pairs, axis=1)
    return order[np.searchsorted(keys, pair_keys, sorter=order)]


def build_facets(mesh: MeshTet, order: int) -> Facets:
    """Quadrature on the boundary. Raises SolveError when the order has a rule with negative weights."""
    points, w = get_quadrature(RefTri, order)
    if w.min() <= 0.0:
        raise SolveError(f"the contact order {order} has a rule with negative weights: use 4, 5, 6 or 8")
    values, slopes = basis_table(ElementTriP2(), points)
    table = facet_nodes(mesh)
    tangents = np.einsum("fni,qJn->fqJi", nodes(mesh)[table], slopes)
    area = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=2)
    return Facets(table, values, slopes, area * w)


def surface_triangles(mesh: MeshTet) -> np.ndarray:
    """Boundary as linear triangles, outward, four to a facet, (4 nf, 3) indices into nodes(mesh)."""
    table = facet_nodes(mesh)
    quarters = ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))
    return np.vstack([table[:, q] for q in quarters])


def curve(
    mesh: MeshTet, project: Callable[[np.ndarray], np.ndarray], on_surface: Callable[[np.ndarray], np.ndarray]
) -> MeshTet2:
    """A second-order mesh whose mid-side nodes on a surface lie on that surface.

    project: (3, N) points -> (3, N) points on the true surface [m].
    on_surface: (3, N) points -> bool (N,); a boundary facet is curved when its three vertices are on it.
    The vertices stay. Elements folded by the move are refused when the problem is set up.
    """
    curved = MeshTet2.from_mesh(mesh)
    points = nodes(mesh).T.copy()
    table = facet_nodes(mesh)
    chosen = np.asarray(on_surface(points), dtype=bool)[table[:, :3]].all(axis=1)
    middles = np.unique(table[chosen, 3:])
    points[:, middles] = project(points[:, middles])
    return replace(curved, doflocs=points)
