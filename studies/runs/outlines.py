"""Where held tissue ends, strain has no bound: what a body whose elements are coarse there misses."""

import numpy as np

from massspring import Attachment, Body
from massspring.body.points import PointVolumes

FLATTEST = 0.05
"""Least J of which an energy is taken."""


def missed_at_outlines(body: Body, attachments: tuple[Attachment, ...], x: np.ndarray) -> float:
    """About what a quadratic body at positions `x` (n, 3) [m] misses of its force, or of its displacement where weight
    loads it, by its elements at the outlines of what is held [1]; NaN for other bodies and where nothing is held.

    For each region the share of the energy that is in elements at its outline, over the root of the number of its
    facets: √r singularities there have an error like (side of an element) × (energy in elements at the outline).
    17 pulled and hanging organs, uniform bodies: 0.6 to 2.1 times this; adaptive ones less.
    """
    if not (isinstance(body.kept, PointVolumes) and attachments and body.share is None):
        return float("nan")
    rest, now = (np.moveaxis(y[body.tetrahedra[:, 1:]] - y[body.tetrahedra[:, :1]], 1, 2) for y in (body.rest, x))
    gradient = now @ np.linalg.inv(rest)
    j = np.maximum(np.linalg.det(gradient), FLATTEST)
    energy = body.tetrahedron_volumes * ((gradient**2).sum(axis=(1, 2)) * j ** (-2 / 3) - 3.0)
    missed = 0.0
    for attachment in attachments:
        triangles = body.triangles[np.isin(body.triangles, attachment.nodes).all(axis=1)]
        sides = np.sort(np.concatenate([triangles[:, [i, i - 1]] for i in range(3)]), axis=1)
        ends, count = np.unique(sides, axis=0, return_counts=True)
        there = np.isin(body.tetrahedra, ends[count == 1]).any(axis=1)
        facets = max(len(triangles) / 4, 1.0)  # four triangles each
        missed += float(energy[there].sum() / (energy.sum() or np.inf)) / facets**0.5
    return missed
