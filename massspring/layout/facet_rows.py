"""Builds the arrays for contact inside quadratic facets (kernels.points.facets), once before a run."""

from functools import cache

import numpy as np

from massspring.kernels.points.arrays import FacetRows
from massspring.kernels.points.facets import FURTHER

CORNER = np.array([[0, 1, 3], [1, 2, 4], [2, 0, 5]])
"""Both ends and the middle of each side of a facet."""
RULE = ((0.091576213509771, 0.109951743655322), (0.445948490915965, 0.223381589678011))
"""Points (b, b, 1 − 2b) in three turns and their weights: exact to the fourth degree (Strang, Fix 1973; Dunavant 1985),
as in the reference."""
MARGIN = 1.5
"""Factor on the radius of a facet at rest, since it may stretch."""


@cache
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
    """The arrays for those of the facets (f, 6) that have a free node."""
    node = facets[(inverse_mass[facets] > 0.0).any(axis=1)]
    fixed, weight = facet_rule()
    x, number = rest[node], len(weight)
    reach = MARGIN * np.linalg.norm(x - x[:, :3].mean(axis=1, keepdims=True), axis=2).max(axis=1, initial=0.0)
    sides = np.linalg.norm(x[:, :3] - np.roll(x[:, :3], 1, axis=1), axis=2)
    points = (len(node), number + FURTHER)
    shape, mass, coupling = np.zeros((*points, 6)), np.ones(points), np.zeros((*points, points[1]))
    shape[:, :number] = fixed
    coupling[:, :number, :number] = np.einsum("fa,qa,pa->fqp", inverse_mass[node], fixed, fixed)
    mass[:, :number] = 1.0 / np.einsum("fqq->fq", coupling[:, :number, :number])
    return FacetRows(
        node=np.ascontiguousarray(node, dtype=np.uint32),
        count=np.full(len(node), number),
        half_side=0.5 * sides.max(axis=1, initial=0.0),
        shape=shape,
        mass=mass,
        reach=reach,
        near=np.zeros(len(node), dtype=np.uint32),
        contact_id=np.zeros(points, dtype=np.int64),
        pressing=np.zeros(points),
        normal=np.zeros((*points, 3)),
        dragging=np.zeros((*points, 3)),
        anchor=np.zeros((*points, 3)),
        coupling=coupling,
        candidate=np.zeros(points, dtype=np.int64),
        gap=np.zeros(points),
        pressed=np.zeros(len(node), dtype=bool),
        **{name: np.zeros((*points, 3)) for name in ("slope", "start", "last_force")},
        **{name: np.zeros((points[1], 3)) for name in ("point_speed", "change")},
    )
