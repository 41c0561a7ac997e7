"""Which points are in contact at the end of a Newton step: its linearised contact problem, solved to the end.

With the body and the obstacles' surfaces linearised, the pressures are still t = max(0, m - eps (g + n·d)). Newton's
tangent assumes a fixed set of touching points; if other points touch, the step ends out of balance and points alternate
from step to step. Each point that changes is a rank-one change eps w b bᵀ of the tangent, b = n N, so that the same
factors can be used for any set of points (Sherman, Morrison and Woodbury; Hager, SIAM Review 31, 1989; docs/theory.md,
eq. 6.5), and a semismooth Newton iteration finds the set (Hintermüller, Ito and Kunisch, SIAM J. Optim. 13, 2003).
"""

from collections.abc import Container
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from reference_fem.compiled import compiled
from reference_fem.contact.augmented import Touch
from reference_fem.contact.faces import FaceTouch, gaps_and_slopes
from reference_fem.elements.surface import point_positions
from reference_fem.model.obstacles import gap_into
from reference_fem.statics.tangent import Tangent
from reference_fem.system.saddle_point import Evaluation, System

ROUNDS = 20
"""Most sets of points that are tried; 2 to 7 are usual. The set of the last round gives a usable direction in any
case."""

BATCH = 32
"""Points whose influence is computed at once: a column then costs a quarter of a single solve, and little memory."""

MOST = 512
"""Most points that may change: more would cost more than the factorisation that they save."""


class Points(NamedTuple):
    """The np contact points that may begin or cease to touch."""

    directions: sp.csr_matrix
    """b = n N of each, so that b·d is its motion away from its obstacle, (np, total)."""
    gap: np.ndarray
    """Gap to the obstacle at its new position [m]."""
    multiplier: np.ndarray
    """m [Pa]."""
    penalty: np.ndarray
    """eps [Pa/m]."""
    area: np.ndarray
    """Rest area w [m²]."""
    touching: np.ndarray
    """Whether the tangent treats it as in contact, bool."""
    excess: np.ndarray
    """Pressure on which the tangent is based minus that in the residual [Pa]."""
    place: tuple
    """Obstacle, facet and point of each; on the faces of a cut facet and point."""


@compiled()
def look_at(rows: np.ndarray, y: np.ndarray, gap: np.ndarray, normal: np.ndarray):
    """Gaps (no, nf, nq) [m] and normals (no, nf, nq, 3) of the points y (nf, nq, 3) [m]."""
    along = np.empty(3)
    for o in range(gap.shape[0]):
        for f in range(gap.shape[1]):
            for q in range(gap.shape[2]):
                gap[o, f, q] = gap_into(rows[o], y[f, q], normal[o, f, q], along)[0]


def points_near(system: System, touch: Touch, x: np.ndarray, change: np.ndarray) -> Points:
    """The points on facets that are, or after the change will be, no farther from an obstacle than their size.

    Of a stuck point only the normal part is included: its traction stays as in the tangent.
    """
    surface, counted = system.surface, touch.guess if len(touch.guess) else touch.pressure
    y = point_positions(x, surface)
    moved = point_positions(change[: len(surface.rest)] - surface.rest, surface)
    gap, normal = np.empty_like(touch.multiplier), np.empty((*touch.multiplier.shape, 3))
    look_at(touch.rows, y, gap, normal)
    after = gap + np.einsum("ofqi,fqi->ofq", normal, moved) - np.einsum("ofqi,oi->ofq", normal, touch.shift)
    reach = np.sqrt(surface.weights.sum(axis=1))[:, None]
    close = (np.minimum(gap, after) < reach) | (counted > 0.0)
    near = np.repeat(close.any(axis=2)[..., None], gap.shape[2], axis=2)
    place = o, f, q = np.nonzero(near)
    n, shapes = normal[place], surface.values[q]
    values = (n[:, :, None] * shapes[:, None, :]).ravel()
    start = surface.dofs.shape[1] * np.arange(len(o) + 1)
    directions = sp.csr_matrix((values, surface.dofs[f].ravel(), start), shape=(len(o), system.total))
    m, eps, touching = touch.multiplier[place], touch.penalty[f], counted[place] > 0.0
    excess = np.where(touching, m - eps * gap[place], 0.0) - touch.pressure[place]
    ahead = gap[place] - np.sum(n * touch.shift[o], axis=1)
    return Points(directions, ahead, m, eps, surface.weights[f, q], touching, excess, place)


def points_between(system: System, touch: FaceTouch, x: np.ndarray, change: np.ndarray) -> Points:
    """The same for the faces of a cut: b = dg/dx."""
    faces, counted = system.faces, touch.guess if len(touch.guess) else touch.pressure
    gap, slopes = gaps_and_slopes(x, faces)
    after = gap + np.einsum("fqr,fr->fq", slopes, change[faces.dofs])
    reach = np.sqrt(faces.weights.sum(axis=1))[:, None]
    near = ((np.minimum(gap, after) < reach) | (counted > 0.0)).any(axis=1)
    place = f, _ = np.nonzero(np.repeat(near[:, None], gap.shape[1], axis=1))
    start = faces.dofs.shape[1] * np.arange(len(f) + 1)
    dofs = faces.dofs[f].ravel().astype(np.int64)
    directions = sp.csr_matrix((slopes[place].ravel(), dofs, start), shape=(len(f), system.total))
    m, eps, touching = touch.multiplier[place], touch.penalty[f], counted[place] > 0.0
    excess = np.where(touching, m - eps * gap[place], 0.0) - touch.pressure[place]
    return Points(directions, gap[place], m, eps, faces.weights[place], touching, excess, place)


def near(system: System, evaluation: Evaluation, x: np.ndarray, change: np.ndarray):
    """All points that may change, and those at obstacles and between faces."""
    parts = points_near(system, evaluation.touch, x, change), points_between(system, evaluation.faces, x, change)
    return together(*parts), parts


def together(one: Points, other: Points) -> Points:
    directions = sp.csr_matrix(sp.vstack([one.directions, other.directions]))
    gap, m, eps, area, touching, excess = (np.concatenate(both) for both in zip(one[1:-1], other[1:-1], strict=True))
    return Points(directions, gap, m, eps, area, touching, excess, ())


def excess(system: System, evaluation: Evaluation, x: np.ndarray):
    """By how much the contact forces that the tangent assumes exceed those in the residual, (n free,) [N]."""
    points = near(system, evaluation, x, np.zeros_like(x))[0]
    return points.directions[:, system.pattern.free].T @ (points.area * points.excess)


class Influence:
    """How all points move when one of them is pushed; computed on first use.

    These solves are not checked: Newton's change, solved before with the same factors, has checked the factors.
    """

    def __init__(self, system: System, tangent: Tangent, points: Points):
        self.tangent, self.points = tangent, points
        self.pushes = points.directions[:, system.pattern.free]
        self.columns: dict[int, np.ndarray] = {}

    def of(self, chosen: np.ndarray):
        """Movement of all points off their obstacles per force [m/N], (np, len(chosen))."""
        new = [k for k in chosen if k not in self.columns]
        if new:
            pushes = self.pushes[new].T.toarray(order="F")
            moves = self.points.directions @ self.tangent.respond(pushes, checked=False)
            self.columns |= dict(zip(new, moves.T, strict=True))
        return np.array([self.columns[k] for k in chosen]).reshape(len(chosen), len(self.points.gap)).T

    def forces(self, push: np.ndarray):
        """Forces on the free unknowns of pushes (np,) [N] at the points."""
        return self.pushes.T @ push


def settled(system: System, tangent: Tangent, x: np.ndarray, change: np.ndarray):
    """Newton's change (total,) of x with the contact of the linearised problem settled, and its pressures at obstacles
    (no, nf, nq) and between faces (nf, nq). `change` is that of the tangent, with the forces of `excess`.

    The next tangent is based on these pressures: they predict better than the gaps which points will touch.
    """
    touch, faces = tangent.evaluation.touch, tangent.evaluation.faces
    points, parts = near(system, tangent.evaluation, x, change)
    influence = Influence(system, tangent, points)
    plain = gap = points.gap + points.directions @ change
    push = np.zeros(len(gap))
    for _ in range(ROUNDS):
        chosen = first_of(points, changed(points, gap), gap, influence.columns)
        if len(set(chosen) | influence.columns.keys()) > MOST:
            break
        goal, moves = np.zeros(len(gap)), influence.of(chosen)
        goal[chosen] = pushes(points, chosen, moves[chosen], plain)
        there = plain + moves @ goal[chosen]
        if np.array_equal(chosen, changed(points, there)):
            push, gap = goal, there
            break
        share = share_of(points, push, goal - push, gap, there - gap)
        push, gap = push + share * (goal - push), gap + share * (there - gap)
    guesses, counted = (np.zeros_like(touch.multiplier), np.zeros_like(faces.multiplier)), pressures(points, gap)
    for guess, part, values in zip(guesses, parts, np.split(counted, [len(parts[0].gap)]), strict=True):
        guess[part.place] = values
    return (change + tangent.respond(influence.forces(push)) if push.any() else change), *guesses


def pressures(points: Points, gap: np.ndarray):
    """t = max(0, m - eps g) [Pa]."""
    return np.maximum(0.0, points.multiplier - points.penalty * gap)


def changed(points: Points, gap: np.ndarray):
    """Numbers of the points that touch but are not in the tangent, or are in the tangent but do not touch."""
    return np.flatnonzero((pressures(points, gap) > 0.0) != points.touching)


def first_of(points: Points, changed: np.ndarray, gap: np.ndarray, known: Container[int]):
    """The changed points whose influence is known, and a batch of the others, those with the largest forces: a third of
    what changes at first changes back once these have changed."""
    new = np.array([k not in known for k in changed], dtype=bool)
    force = np.where(new, points.area[changed] * np.abs(points.multiplier - points.penalty * gap)[changed], np.inf)
    return np.sort(changed[np.argsort(-force, kind="stable")[: BATCH + np.count_nonzero(~new)]])


def pushes(points: Points, chosen: np.ndarray, moves: np.ndarray, gap: np.ndarray):
    """Forces [N] at the points that change, (k,): +w t for those that touch, -w t for those that the tangent treats as
    touching.

    From t = m - eps (gap + moves·push) (eq. 6.5); moves (k, k): among themselves.
    """
    sign = np.where(points.touching[chosen], -1.0, 1.0)
    eps = points.penalty[chosen]
    matrix = np.diag(sign / points.area[chosen]) + eps[:, None] * moves
    return np.linalg.solve(matrix, points.multiplier[chosen] - eps * gap[chosen])


def share_of(points: Points, push: np.ndarray, more: np.ndarray, gap: np.ndarray, moved: np.ndarray):
    """Line search: the share of a change of pushes and gaps, up to 1, that lowers the potential most. Without it sets
    may cycle.

    The slope, sum moved (push - w (t - t of the tangent)), grows with the share; bisection finds its root to a
    thousandth.
    """

    def slope(share: float):
        there = gap + share * moved
        counted = np.where(points.touching, points.multiplier - points.penalty * there, 0.0)
        return moved @ (push + share * more - points.area * (pressures(points, there) - counted))

    low, high = 0.0, 1.0
    if slope(high) <= 0.0:
        return high
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if slope(middle) <= 0.0 else (low, middle)
    return high
