"""Contact with rigid obstacles at the quadrature points of the boundary, frictionless or without slip.

Augmented Lagrangian (Alart & Curnier 1991; Wriggers, Computational Contact Mechanics, 2006, ch. 6): the nominal
pressure is t = max(0, m - eps g), m the multiplier [Pa], g the gap [m], eps the penalty [Pa/m], and the potential
sum w (t² - m²) / (2 eps). Contact is not at nodes, because a uniform pressure gives no force at the vertices of a
six-node facet. No slip: a point that touched at the end of a load step sticks to the place of the obstacle that it
touched, by the traction T = m_T - eps s, s its slip tangential to the obstacle there; it is released when its pressure
ends. The place is accurate to the length of a load step: take shorter steps for a no-slip contact that spreads.

The rule of order 4 has as many points as a facet has nodes. With more points a facet in partial contact has more
conditions than degrees of freedom; with fewer the body penetrates between the points: with three points by three to
thirty times a thousandth.
"""

from typing import NamedTuple

import numpy as np

from reference_fem.compiled import compiled
from reference_fem.elements.surface import Surface, add_point_stiffness, point_into, point_positions, scatter
from reference_fem.model.obstacles import gap_into, gaps


class Grip(NamedTuple):
    """Points held by no-slip obstacles; arrays of length 0 if all obstacles are frictionless."""

    stuck: np.ndarray
    """Points that are held, (no, nf, nq) bool."""
    anchor: np.ndarray
    """Place at which each point is held, relative to the reference point of the obstacle, (no, nf, nq, 3) [m]."""
    traction: np.ndarray
    """Multiplier m_T, (no, nf, nq, 3) [Pa]."""


NO_GRIP = Grip(np.zeros((0, 0, 0), dtype=bool), np.zeros((0, 0, 0, 3)), np.zeros((0, 0, 0, 3)))
NO_GUESS = np.zeros((0, 0, 0))


class Touch(NamedTuple):
    """State of all contacts: no obstacles."""

    rows: np.ndarray
    """Obstacles at their current positions, (no, 8)."""
    shift: np.ndarray
    """Further motion of the obstacles to be linearised, (no, 3) [m]; zero except in a predictor."""
    multiplier: np.ndarray
    """m at every point, (no, nf, nq) [Pa]."""
    penalty: np.ndarray
    """eps of each facet, (nf,) [Pa/m]."""
    grip: Grip
    guess: np.ndarray
    """Pressures on which the tangent is based, (no, nf, nq) [Pa]; of length 0: those are t."""
    pressure: np.ndarray
    """t at every point, overwritten, (no, nf, nq) [Pa]."""
    traction: np.ndarray
    """T at every point, overwritten, shaped like the grip's [Pa]."""
    force: np.ndarray
    """Resultant on the body, overwritten, (no, 3) [N]."""


def touch(
    rows: np.ndarray,
    shift: np.ndarray,
    multiplier: np.ndarray,
    penalty: np.ndarray,
    grip: Grip = NO_GRIP,
    guess: np.ndarray = NO_GUESS,
) -> Touch:
    zeros = np.zeros_like(multiplier), np.zeros_like(grip.traction), np.zeros((len(rows), 3))
    return Touch(rows, shift, multiplier, penalty, grip, guess, *zeros)


@compiled()
def add_contact(x: np.ndarray, surface: Surface, touch: Touch, values: np.ndarray, residual: np.ndarray, tangent: bool):
    """residual -= w (t n + T) N and, if tangent, values += w d²(potential) N N; fills touch (eq. 6.2, 6.4).

    Normal part: eps n⊗n - t curvature (1 - n⊗n - a⊗a); part of a stuck point: eps (1 - n0⊗n0), n0 at its anchor.
    """
    dofs, positions, rest, shapes, weights, _ = surface
    count = shapes.shape[1]
    nodes, y = np.empty((count, 3)), np.empty(3)
    k, push, K = np.empty((3, 3)), np.empty(3), np.empty((3 * count, 3 * count))
    touch.force[:] = 0.0
    for o in range(touch.rows.shape[0]):
        for f in range(dofs.shape[0]):
            for i in range(3):
                for a in range(count):
                    dof = dofs[f, count * i + a]
                    nodes[a, i] = rest[dof] + x[dof]
            if not counted(touch, o, f) and out_of_reach(touch.rows[o], nodes):
                continue
            touched = False
            for q in range(weights.shape[1]):
                point_into(shapes[q], nodes, y)
                if not press_point(touch, o, f, q, y, push, k):
                    continue
                if tangent and not touched:
                    K[:] = 0.0
                touched = True
                w = weights[f, q]
                for i in range(3):
                    touch.force[o, i] += w * push[i]
                    moved = push[i]
                    for j in range(3):
                        moved += k[i, j] * touch.shift[o, j]
                        k[i, j] *= w
                    for a in range(count):
                        residual[dofs[f, count * i + a]] -= w * moved * shapes[q, a]
                if tangent:
                    add_point_stiffness(shapes[q], k, K)
            if tangent and touched:
                scatter(K, positions[f], values)


@compiled()
def counted(touch: Touch, o: int, f: int):
    """Whether a point of a facet has a multiplier, or a pressure on which the tangent is based."""
    for q in range(touch.multiplier.shape[2]):
        if touch.multiplier[o, f, q] > 0.0 or (len(touch.guess) and touch.guess[o, f, q] > 0.0):
            return True
    return False


@compiled()
def out_of_reach(row: np.ndarray, nodes: np.ndarray):
    """Whether a facet without multipliers is too far from an obstacle for any of its points to touch.

    The functions of a six-node triangle sum to 5/3 at most in absolute value, so its points stay within twice the
    distance of the nodes from their centre.
    """
    centre, n, along, reach = np.zeros(3), np.empty(3), np.empty(3), 0.0
    for a in range(len(nodes)):
        for i in range(3):
            centre[i] += nodes[a, i] / len(nodes)
    for a in range(len(nodes)):
        d = 0.0
        for i in range(3):
            d += (nodes[a, i] - centre[i]) ** 2
        reach = max(reach, d)
    return gap_into(row, centre, n, along)[0] > 2.0 * np.sqrt(reach)


@compiled()
def press_point(touch: Touch, o: int, f: int, q: int, y: np.ndarray, push: np.ndarray, k: np.ndarray):
    """push = t n + T (3,) and k = -d push/dy (3, 3) at the point y; False when both are zero.

    With a guess s of the pressure, k and T are those of a point pressed by s, whether or not it touches.
    """
    row, eps = touch.rows[o], touch.penalty[f]
    n, along = np.empty(3), np.empty(3)
    g, curvature = gap_into(row, y, n, along)
    t = s = max(0.0, touch.multiplier[o, f, q] - eps * g)
    touch.pressure[o, f, q] = t
    if len(touch.guess):
        s = touch.guess[o, f, q]
    if t == 0.0 and s == 0.0:
        return False
    stiff = eps if s > 0.0 else 0.0
    for i in range(3):
        push[i] = t * n[i]
        for j in range(3):
            k[i, j] = (stiff + s * curvature) * n[i] * n[j] + s * curvature * along[i] * along[j]
        k[i, i] -= s * curvature
    if s > 0.0 and o < touch.grip.stuck.shape[0] and touch.grip.stuck[o, f, q]:
        hold_point(touch, o, f, q, y, push, k)
    return True


@compiled()
def hold_point(touch: Touch, o: int, f: int, q: int, y: np.ndarray, push: np.ndarray, k: np.ndarray):
    """push += T (3,) and k -= dT/dy (3, 3) of a stuck point y."""
    row, grip, eps = touch.rows[o], touch.grip, touch.penalty[f]
    n, along, z, sunk = np.empty(3), np.empty(3), np.empty(3), 0.0
    for i in range(3):
        z[i] = row[1 + i] + grip.anchor[o, f, q, i]
    gap_into(row, z, n, along)
    for i in range(3):
        sunk += n[i] * (y[i] - z[i])
    for i in range(3):
        T = grip.traction[o, f, q, i] - eps * (y[i] - z[i] - sunk * n[i])
        touch.traction[o, f, q, i] = T
        push[i] += T
        for j in range(3):
            k[i, j] -= eps * n[i] * n[j]
        k[i, i] += eps


def first_grip(rows: np.ndarray, sticks: np.ndarray, surface: Surface, x: np.ndarray, near: float) -> Grip:
    """The grip at the start: of sticking obstacles, the points not farther than `near` [m]."""
    if not sticks.any():
        return NO_GRIP
    shape = (len(rows), *surface.weights.shape)
    y = point_positions(x, surface)
    stuck = np.array([stick & (gaps(row, y) <= near) for row, stick in zip(rows, sticks, strict=True)])
    return Grip(stuck, y - rows[:, None, None, 1:4], np.zeros((*shape, 3)))


def renewed_grip(touch: Touch, sticks: np.ndarray, surface: Surface, x: np.ndarray) -> Grip:
    """The grip after a load step: a pressed point that was stuck keeps its place, any other sticks where it is now."""
    old = touch.grip
    if not sticks.any():
        return old
    stuck = sticks[:, None, None] & (touch.pressure > 0.0)
    here = point_positions(x, surface) - touch.rows[:, None, None, 1:4]
    kept = (stuck & old.stuck)[..., None]
    return Grip(stuck, np.where(kept, old.anchor, here), np.where(kept, touch.traction, 0.0))


def penetration(touch: Touch):
    """Deepest point inside an obstacle [m], from t = m - eps g where t > 0."""
    depth = (touch.pressure - touch.multiplier) / touch.penalty[:, None]
    return float(np.max(depth, initial=0.0, where=touch.pressure > 0.0))


def slippage(touch: Touch):
    """Farthest that a stuck point has slipped [m], from T = m_T - eps s where it is pressed."""
    if not touch.grip.stuck.size:
        return 0.0
    slip = np.linalg.norm(touch.traction - touch.grip.traction, axis=-1) / touch.penalty[:, None]
    return float(np.max(slip, initial=0.0, where=touch.grip.stuck & (touch.pressure > 0.0)))


def mistaken(touch: Touch):
    """Whether a point is held without contact pressure, or pressed but not held: the guess was then wrong."""
    if not (touch.grip.stuck.size and touch.guess.size):
        return False
    return bool(np.any(touch.grip.stuck & ((touch.guess > 0.0) != (touch.pressure > 0.0))))


def misplacement(touch: Touch):
    """Largest distance from the surface of its obstacle, on either side, of a point with a contact pressure [m].

    Such a point is too deep, or it is moving out and still pushed by an earlier multiplier.
    """
    off = np.abs(touch.pressure - touch.multiplier) / touch.penalty[:, None]
    return float(np.max(off, initial=0.0, where=touch.pressure > 0.0))
