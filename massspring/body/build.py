"""Builds bodies from meshes, with springs, stiffnesses and masses: organs filled with tissue, and the paper's surface
body."""

from collections.abc import Sequence

import numpy as np

from massspring.body.axis import closest_virtual_node, virtual_nodes
from massspring.body.body import Body, Material, check_positive
from massspring.body.laws import Edges, laws_by_name
from massspring.body.smoothed import SMOOTHED
from massspring.body.springs import (
    EDGES_OF_TRIANGLE,
    SpringKind,
    Springs,
    bending_pairs,
    lengths,
    matched_scale,
    unique_edges,
)
from massspring.body.surface import check_surface, checked_indices, checked_points
from massspring.errors import MassSpringError
from massspring.kernels.forces.volume import enclosed_volume

AXIS_MASS_SHARE = 0.25
"""A pyramid over the axis has a quarter of its mass at the apex (linear shape functions)."""
SURFACE_WEIGHTS = {SpringKind.STRUCTURAL: 1.0, SpringKind.BENDING: 0.5, SpringKind.INNER: 0.5, SpringKind.AXIAL: 1.0}
"""Relative stiffness of the kinds; their sum is scaled to the shear modulus. The paper names no values."""


def tetrahedral_body(
    points: np.ndarray,
    triangles: np.ndarray,
    tetrahedra: np.ndarray,
    material: Material,
    law: str = "van_gelder",
    share: np.ndarray | None = None,
) -> Body:
    """Springs on the edges of a tetrahedral mesh.

    `points` (n, 3) [m]; `triangles` (f, 3), its boundary, outward; `tetrahedra` (k, 4), positive; `law` one of
    `massspring.body.laws.LAWS` or of `smoothed.SMOOTHED`. Those without rest length need one volume per node:
    `body.keeping(Volumes.nodal(body))`. `share` (k,): part of each cell that is tissue (`virtual_nodes`); None: all.
    Raises MassSpringError.
    """
    points = checked_points(points)
    tetrahedra = checked_indices("tetrahedra", tetrahedra, 4, len(points))
    triangles = checked_indices("triangles", triangles, 3, len(points))
    if not len(tetrahedra):
        raise MassSpringError("the body has no tetrahedra; give a mesh of its inside, or use surface_body")
    if share is not None and np.shape(share) != (len(tetrahedra),):
        raise MassSpringError(f"share has shape {np.shape(share)}; give one number for each of {len(tetrahedra)} cells")
    edges = Edges(points, tetrahedra, share)
    check_positive(edges.volumes)
    springs, taut = _springs_of(law, edges, material.shear_modulus)
    corner = np.repeat(edges.volumes, 4)
    mass = np.bincount(tetrahedra.ravel(), weights=corner, minlength=len(points)) * material.density / 4.0
    pressure = material.shear_modulus if taut else 0.0
    return Body(points, mass, springs, triangles, tetrahedra, law, rest_pressure=pressure, share=share)


def _springs_of(law: str, edges: Edges, mu: float) -> tuple[Springs, bool]:
    """The springs of a stiffness law, and whether they are taut at rest, without length."""
    laws = laws_by_name()
    if law not in (*laws, *SMOOTHED):
        raise MassSpringError(f"unknown stiffness law '{law}'; known: {', '.join((*laws, *SMOOTHED))}")
    if law in SMOOTHED:
        ends, stiffness = SMOOTHED[law](edges, mu)
    else:
        ends, stiffness = edges.ends, laws[law].stiffness(edges, mu)
    taut = law in SMOOTHED or not laws[law].rest_length
    length = np.zeros(len(ends)) if taut else edges.length
    kind = np.full(len(ends), SpringKind.SOLID, dtype=np.uint8)
    return Springs(np.ascontiguousarray(ends, dtype=np.uint32), length, stiffness, kind), taut


def surface_body(
    points: np.ndarray,
    triangles: np.ndarray,
    material: Material,
    axis: str = "straight",
    weights: Sequence[float] | None = None,
) -> Body:
    """The paper's body (JHC05, section 3): structural, bending and inner springs, virtual nodes on the dominant axis.

    `points` (n, 3) [m] are the surface nodes, `triangles` (f, 3) outward; `axis` one of `AXES`; `weights` the relative
    stiffnesses of structural, bending, inner and axial springs, `SURFACE_WEIGHTS` where none are given. The virtual
    nodes follow the surface nodes; consecutive ones are joined by axial springs, without which the axis could come
    apart. Raises MassSpringError.
    """
    points = checked_points(points)
    triangles = checked_indices("triangles", triangles, 3, len(points))
    check_surface(points, triangles)
    structural = unique_edges(triangles, EDGES_OF_TRIANGLE)
    virtual = virtual_nodes(points, triangles, float(lengths(points, structural).mean()), axis)
    nearest = closest_virtual_node(points, virtual)
    used, nearest = np.unique(nearest, return_inverse=True)
    rest = np.vstack([points, virtual[used]])
    first = len(points)
    groups = {
        SpringKind.STRUCTURAL: structural,
        SpringKind.BENDING: bending_pairs(triangles),
        SpringKind.INNER: np.column_stack([np.arange(first), first + nearest]),
        SpringKind.AXIAL: np.column_stack([np.arange(first, len(rest) - 1), np.arange(first + 1, len(rest))]),
    }
    ends = np.vstack(list(groups.values())).astype(np.uint32)
    kind = np.repeat([int(k) for k in groups], [len(g) for g in groups.values()]).astype(np.uint8)
    length = lengths(rest, ends)
    of_kind = tuple(SURFACE_WEIGHTS.values()) if weights is None else checked_weights(weights)
    weight = np.array(of_kind)[kind]
    volume = float(enclosed_volume(points, triangles))
    stiffness = weight * matched_scale(material.shear_modulus, volume, weight, length)
    mass = _surface_mass(points, triangles, nearest, len(used)) * material.density * volume
    law = "per_kind" if weights is None else f"per_kind {':'.join(f'{w:g}' for w in of_kind)}"
    return Body(rest, mass, Springs(ends, length, stiffness, kind), triangles, law=law)


def checked_weights(weights: Sequence[float]) -> tuple[float, ...]:
    """Four relative stiffnesses, none negative, not all of the first three 0. Raises MassSpringError."""
    given = tuple(float(w) for w in weights)
    if len(given) != len(SURFACE_WEIGHTS) or not (np.isfinite(given).all() and min(given) >= 0 and max(given[:3]) > 0):
        names = ", ".join(kind.name.lower() for kind in SURFACE_WEIGHTS)
        raise MassSpringError(
            f"the weights of the springs are {given}; give four for {names}: not negative, one of the first three not 0"
        )
    return given


def _surface_mass(points: np.ndarray, triangles: np.ndarray, nearest: np.ndarray, axis_nodes: int) -> np.ndarray:
    """Shares of the mass, (n + a,), summing to 1: by area on the surface, by the area they carry on the axis."""
    corners = points[triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    share = np.bincount(triangles.ravel(), weights=np.repeat(area, 3), minlength=len(points)) / (3.0 * area.sum())
    axis = np.bincount(nearest, weights=share, minlength=axis_nodes)
    return np.concatenate([(1.0 - AXIS_MASS_SHARE) * share, AXIS_MASS_SHARE * axis])
