"""Taylor-Hood P2/P1 on tetrahedra: reference tables and the geometry of one mesh, from scikit-fem.

A local vector has 34 entries: u_x at the ten nodes, then u_y, u_z, then p at the four vertices.
"""

from typing import NamedTuple

import numpy as np
from skfem import ElementTetP1, ElementTetP2, ElementTriP2, MeshTet
from skfem.assembly import Dofs
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet, RefTri

from reference_fem.errors import ReferenceProblem

FACET_EDGES = ((0, 1), (1, 2), (0, 2))
"""Vertex pairs of the mid-side nodes 3, 4, 5 of a six-node triangle."""


class Elements(NamedTuple):
    """Everything the element kernel reads, for `ne` elements and `nq` quadrature points each."""

    dofs: np.ndarray
    """Global unknown of each local one, (ne, 34) uint32."""
    gradients: np.ndarray
    """Rest gradients of the ten displacement functions, (ne, nq, 3, 10) [1/m]."""
    pressures: np.ndarray
    """Values of the four pressure functions, (nq, 4)."""
    weights: np.ndarray
    """Rest volume of each quadrature point, (ne, nq) [m³]."""


class Facets(NamedTuple):
    """Boundary facets as six-node triangles, turned outward, for `nf` facets and `nq` points each."""

    nodes: np.ndarray
    """Three vertices, then the mid-side nodes of FACET_EDGES, (nf, 6)."""
    values: np.ndarray
    """Values of the six functions, (nq, 6)."""
    weights: np.ndarray
    """Rest area of each quadrature point, (nf, nq) [m²]."""


def basis_table(element, points):
    """Values (nq, nb) and gradients (nq, dim, nb) of a scikit-fem element at points (dim, nq)."""
    count = element.doflocs.shape[0]
    pairs = [element.lbasis(points, i) for i in range(count)]
    values = np.stack([np.broadcast_to(v, points.shape[1:]) for v, _ in pairs], axis=1)
    gradients = np.stack([np.asarray(g, dtype=float).T for _, g in pairs], axis=2)
    return values, gradients


def element_nodes(mesh):
    """P2 nodes of every tetrahedron, (ne, 10): four vertices, then six mid-side nodes."""
    return Dofs(mesh, ElementTetP2()).element_dofs.T


def nodes(mesh: MeshTet) -> np.ndarray:
    """Rest positions of the P2 nodes, (N2, 3) [m]: the vertices, then the edges' mid-side nodes."""
    if mesh.doflocs.shape[1] > mesh.nvertices:
        return np.ascontiguousarray(mesh.doflocs.T)
    middles = mesh.p[:, mesh.edges].mean(axis=1)
    return np.ascontiguousarray(np.hstack((mesh.p, middles)).T)


def build_elements(mesh: MeshTet, order: int) -> Elements:
    """Tables of every element; raises ReferenceProblem for folded or flat elements.

    order: degree that the quadrature integrates exactly; u enters J as a cubic and p J as a quartic.
    """
    points, w = get_quadrature(RefTet, order)
    _, local = basis_table(ElementTetP2(), points)
    pressures, _ = basis_table(ElementTetP1(), points)
    table, x = element_nodes(mesh), nodes(mesh)
    jacobian = np.einsum("eni,qJn->eqiJ", x[table], local)
    det = np.linalg.det(jacobian)
    check_shapes(det)
    gradients = np.einsum("eqJi,qJn->eqin", np.linalg.inv(jacobian), local)
    count = len(x)
    dofs = np.hstack([3 * table + c for c in range(3)] + [3 * count + table[:, :4]])
    return Elements(dofs.astype(np.uint32), np.ascontiguousarray(gradients), pressures, np.abs(det) * w)


def check_shapes(det):
    """Refuse elements whose map folds: the sign of det (ne, nq) must not change inside one element."""
    largest = np.abs(det).max(axis=1)
    folded = det.min(axis=1) * det.max(axis=1) <= 0.0
    # 1e-10 of the typical size is far below what a meshing tool leaves and far above round-off
    bad = np.flatnonzero(folded | (largest < 1e-10 * np.median(largest)))
    if bad.size:
        raise ReferenceProblem(
            f"element {bad[0]} is inverted or flat at rest ({bad.size} such elements; smallest volume ratio "
            f"{(det.min(axis=1) * np.sign(det.mean(axis=1)) / largest)[bad[0]]:.1e}, limit > 0): mend the mesh, "
            f"or leave its mid-side nodes straight"
        )


def check_neighbours(mesh):
    """Refuse an inside-out element: the two tetrahedra at a face must lie on opposite sides of it."""
    inner = np.flatnonzero(mesh.f2t[1] >= 0)
    a, b, c = mesh.p[:, mesh.facets[:, inner]].transpose(1, 2, 0)
    normal = np.cross(b - a, c - a)
    sides = []
    for k in (0, 1):
        element = mesh.t[:4, mesh.f2t[k, inner]]
        other = element.sum(axis=0) - mesh.facets[:, inner].sum(axis=0)
        sides.append(np.einsum("ni,ni->n", mesh.p[:, other].T - a, normal))
    bad = np.flatnonzero(sides[0] * sides[1] >= 0.0)
    if bad.size:
        pair = mesh.f2t[:, inner[bad[0]]]
        raise ReferenceProblem(
            f"elements {pair[0]} and {pair[1]} overlap across their common face ({bad.size} such faces, limit 0): "
            f"one of them is inverted, mend the mesh"
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


def edge_index(mesh, pairs):
    """Rows of mesh.edges that join the vertex pairs (n, 2)."""
    count = mesh.nvertices
    keys = np.min(mesh.edges, axis=0) * np.int64(count) + np.max(mesh.edges, axis=0)
    order = np.argsort(keys)
    wanted = np.min(pairs, axis=1) * np.int64(count) + np.max(pairs, axis=1)
    return order[np.searchsorted(keys, wanted, sorter=order)]


def build_facets(mesh: MeshTet, order: int) -> Facets:
    """Quadrature on the boundary. Raises ReferenceProblem when the order has a rule with negative weights."""
    points, w = get_quadrature(RefTri, order)
    if w.min() <= 0.0:
        raise ReferenceProblem(f"the contact order {order} has a rule with negative weights: use 4, 5, 6 or 8")
    values, local = basis_table(ElementTriP2(), points)
    table = facet_nodes(mesh)
    tangents = np.einsum("fni,qJn->fqJi", nodes(mesh)[table], local)
    area = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=2)
    return Facets(table, values, area * w)


def surface_triangles(mesh: MeshTet) -> np.ndarray:
    """Boundary as linear triangles, outward, four to a facet, (4 nf, 3) indices into nodes(mesh)."""
    table = facet_nodes(mesh)
    quarters = ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))
    return np.vstack([table[:, q] for q in quarters])
