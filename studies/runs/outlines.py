"""Where held tissue or a contact ends, stress has no bound or a kink: what a body with coarse elements there misses."""

from collections.abc import Sequence

import numpy as np

from massspring import Attachment, Body, Capsule, Plane, Sphere
from massspring.body.points import PointVolumes
from studies.scene.kind import has_wall
from studies.scene.scene import Scene

FLATTEST = 0.05
"""Least J of which an energy is taken."""
TOUCH = 1e-3
"""Gap over the size of a body up to which a node touches."""


def regions(scene: Scene, body: Body, attachments: Sequence[Attachment], x: np.ndarray, t: float) -> list[np.ndarray]:
    """The nodes that are held, and of a solid organ those that touch each plane, sphere or capsule at time t [s] with
    the body at `x` (n, 3) [m]; a wall bends where it is touched, and its energy there says little of an error."""
    solid = [] if has_wall(scene) else [one for one in scene.obstacles if isinstance(one, Plane | Sphere | Capsule)]
    near = TOUCH * body.size
    return [*(one.nodes for one in attachments), *(np.flatnonzero(one.gap(x, t) < near) for one in solid)]


def missed_at_outlines(body: Body, places: Sequence[np.ndarray], x: np.ndarray) -> float:
    """About what a quadratic body at positions `x` (n, 3) [m] misses of its force, or of its displacement where weight
    loads it, by its elements at the outlines of places on its surface [1], each given by its nodes; NaN for another
    body and without a place.

    The sum over places of the energy in elements at the outline, over all energy and over √facets of the place: an
    error by √r singularities is like (energy there) × (side of an element over the width of the place). Of 22 uniform
    bodies that were pulled or hung the error was 0.6 to 2.1 times this. In the study accuracy it is beyond the target
    for 73 of 96 bodies that miss it, and for 6 of 155 that do not.
    """
    if not (isinstance(body.kept, PointVolumes) and len(places) and body.share is None):
        return float("nan")
    rest, now = (np.moveaxis(y[body.tetrahedra[:, 1:]] - y[body.tetrahedra[:, :1]], 1, 2) for y in (body.rest, x))
    gradient = now @ np.linalg.inv(rest)
    j = np.maximum(np.linalg.det(gradient), FLATTEST)
    energy = body.tetrahedron_volumes * ((gradient**2).sum(axis=(1, 2)) * j ** (-2 / 3) - 3.0)
    missed = 0.0
    for nodes in places:
        inside = np.isin(body.triangles, nodes)
        whole = np.all(inside, axis=1)
        there = np.isin(body.tetrahedra, body.triangles[inside & ~whole[:, None]]).any(axis=1)
        facets = max(whole.sum() / 4, 1.0)  # four triangles each
        missed += float(energy[there].sum() / (energy.sum() or np.inf)) / facets**0.5
    return missed
