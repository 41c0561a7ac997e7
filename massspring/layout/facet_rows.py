"""Builds the arrays of contact inside quadratic facets (kernels.points.facets), once, before a run."""

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import eigsh

from massspring.kernels.points.facets import SHARE, FacetRows

CORNER = np.array([[0, 1, 3], [1, 2, 4], [2, 0, 5]])
"""Of each side of a facet its ends and its middle."""
RULE = ((0.091576213509771, 0.109951743655322), (0.445948490915965, 0.223381589678011))
"""Points (b, b, 1 − 2b) in three turns and their weights: exact to the fourth degree (Strang, Fix 1973; Dunavant 1985),
as in the reference."""
MARGIN = 1.5
"""On the radius of a facet at rest: it may stretch."""
EIGENVALUE = 1e-6
"""Relative accuracy: the stiffness of contact must not depend on the order of the nodes."""


def facet_rule() -> tuple[np.ndarray, np.ndarray]:
    """Shape functions of corners and mid-sides at six points, (6, 6), and the weights, (6,), which sum to 1."""
    places, weights = [], []
    for b, weight in RULE:
        for turn in range(3):
            places.append(np.roll((b, b, 1.0 - 2.0 * b), turn))
            weights.append(weight)
    b = np.array(places)
    sides = [4.0 * b[:, i] * b[:, j] for i, j, _ in CORNER]
    return np.column_stack([b * (2.0 * b - 1.0), *sides]), np.array(weights)


def facet_rows(facets: np.ndarray, rest: np.ndarray, inverse_mass: np.ndarray) -> FacetRows:
    """Of facets (f, 6) that are not held altogether, as stiff as the masses of their nodes allow."""
    node = facets[(inverse_mass[facets] > 0.0).any(axis=1)]
    shape, weight = facet_rule()
    x = rest[node]
    area = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
    reach = MARGIN * np.linalg.norm(x - x[:, :3].mean(axis=1, keepdims=True), axis=2).max(axis=1, initial=0.0)
    points = (len(node), len(weight))
    return FacetRows(
        node=np.ascontiguousarray(node, dtype=np.uint32),
        shape=shape,
        stiffness=_bed(node, shape, area[:, None] * weight, inverse_mass),
        reach=reach,
        touched=np.zeros(points, dtype=np.int64),
        pressing=np.zeros(points),
        dragging=np.zeros((*points, 3)),
        anchor=np.zeros((*points, 3)),
    )


def _bed(node: np.ndarray, shape: np.ndarray, area: np.ndarray, inverse_mass: np.ndarray) -> np.ndarray:
    """k dt² [kg] of the points with `area` (f, p) [m²]: when all touch, M⁻¹ Σ k N Nᵀ dt² has the largest eigenvalue
    SHARE; facets of light nodes have softer points."""
    if not len(node):
        return area
    n, root = len(inverse_mass), np.sqrt(inverse_mass)
    load = np.einsum("fq,qa,q->fa", area, np.abs(shape), np.abs(shape).sum(axis=1))
    bed = area / (load * inverse_mass[node]).max(axis=1)[:, None]
    rows = np.sqrt(bed)[:, :, None] * shape * root[node][:, None, :]
    columns = np.broadcast_to(node[:, None, :].astype(np.int64), rows.shape)
    number = np.broadcast_to(np.arange(bed.size).reshape(*bed.shape, 1), rows.shape)
    scaled = csr_array((rows.ravel(), (number.ravel(), columns.ravel())), shape=(bed.size, n))
    start = np.random.default_rng(0).standard_normal(n)
    largest = eigsh(scaled.T @ scaled, 1, which="LA", v0=start, tol=EIGENVALUE, return_eigenvectors=False)[0]  # pyright: ignore[reportArgumentType]
    return bed * (SHARE / float(largest))
