"""Contact at points inside quadratic facets, by a pressure that grows until nothing is inside (theory, eq. 9.3–9.9).

At a corner of a quadratic facet a uniform pressure leaves no force, so that nodes alone meet an obstacle unevenly. Here
the force acts where the facet is: f = max(0, λ − k g) with the gap g [m] that the step would end with, and λ follows f
(an augmented Lagrangian with one iteration a step, Simo and Laursen 1992). Friction acts the same way along the facet.
"""

import math
from typing import NamedTuple

import numpy as np

from massspring.kernels.contact.gaps import gap_and_normal
from massspring.kernels.jit.decorators import njit_inlined, njit_lean

SHARE = 1.0 / 3.0
"""k dt²/m: with the body's own stiffness a step stays stable up to 0.86 of the limit without contact, ω²dt² + 3 k dt²/m
< 4, for the gap is that at the end of the step."""
FOLLOWING, FASTEST = 0.7, 0.05
"""λ makes up for φ = min(FOLLOWING c dt, FASTEST) of its difference from f in a step, c the damping [1/s] (eq. 9.5)."""


class FacetRows(NamedTuple):
    """p points in each of f facets, and the state of their contact."""

    node: np.ndarray
    """Corners, then mid-sides, (f, 6) uint32."""
    shape: np.ndarray
    """Shape functions at the points, (p, 6)."""
    stiffness: np.ndarray
    """k dt² [kg], (f, p)."""
    reach: np.ndarray
    """How far a facet is from its middle at most [m], (f,)."""
    touched: np.ndarray
    """1 + the obstacle that a point touches, 0 for none, (f, p) int64."""
    pressing: np.ndarray
    """λ [N], (f, p)."""
    dragging: np.ndarray
    """The same along the obstacle [N], (f, p, 3)."""
    anchor: np.ndarray
    """Where friction holds a point, seen from the obstacle [m], (f, p, 3)."""


@njit_inlined
def following(boundary):
    """How much of the difference between f and λ a step makes up for."""
    return min(FOLLOWING * boundary.damping * boundary.dt, FASTEST)


@njit_inlined
def at_point(table, node, weights, f):
    """Σ_a N_a u_a of `table` (n, 3) at a point of facet f with shape functions `weights` (6,)."""
    u0, u1, u2 = 0.0, 0.0, 0.0
    for a in range(6):
        i, share = node[f, a], weights[a]
        u0, u1, u2 = u0 + share * table[i, 0], u1 + share * table[i, 1], u2 + share * table[i, 2]
    return u0, u1, u2


@njit_inlined
def is_far(facets, nodes, boundary, step, f):
    """Whether no point of facet f can touch an obstacle in this step."""
    x, node = nodes.x, facets.node
    i, j, k = node[f, 0], node[f, 1], node[f, 2]
    c0, c1, c2 = x[i, 0] + x[j, 0] + x[k, 0], x[i, 1] + x[j, 1] + x[k, 1], x[i, 2] + x[j, 2] + x[k, 2]
    for o in range(boundary.radius.shape[0]):
        place = boundary.position[step, o]
        gap, _, _, _ = gap_and_normal(boundary, o, c0 / 3.0 - place[0], c1 / 3.0 - place[1], c2 / 3.0 - place[2])
        if not gap > facets.reach[f]:
            return False
    return True


@njit_inlined
def deepest(facets, boundary, step, y):
    """The obstacle that the point y is deepest in, its gap [m] and normal."""
    best, least, n0, n1, n2 = 0, math.inf, 0.0, 0.0, 0.0
    for o in range(boundary.radius.shape[0]):
        place = boundary.position[step, o]
        gap, m0, m1, m2 = gap_and_normal(boundary, o, y[0] - place[0], y[1] - place[1], y[2] - place[2])
        if gap < least:
            best, least, n0, n1, n2 = o, gap, m0, m1, m2
    return best, least, (n0, n1, n2)


@njit_inlined
def forget(facets, f, q):
    """Nothing is touched at point q."""
    facets.contact_id[f, q], facets.pressing[f, q] = 0, 0.0
    for axis in range(3):
        facets.dragging[f, q, axis] = 0.0


@njit_inlined
def rub(facets, f, q, stiffness, most, place, normal):
    """The force along the obstacle [N]: Coulomb's, at most `most`, towards where friction holds the point.

    `stiffness`: k [N/m] and how much λ follows; `place` (3) [m]: where the point would end the step, seen from the
    obstacle. A point that slides is held there from then on.
    """
    drag, anchor = facets.dragging, facets.anchor
    k, follow = stiffness
    t0 = drag[f, q, 0] - k * (place[0] - anchor[f, q, 0])
    t1 = drag[f, q, 1] - k * (place[1] - anchor[f, q, 1])
    t2 = drag[f, q, 2] - k * (place[2] - anchor[f, q, 2])
    inward = t0 * normal[0] + t1 * normal[1] + t2 * normal[2]
    t0, t1, t2 = t0 - inward * normal[0], t1 - inward * normal[1], t2 - inward * normal[2]
    size = math.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
    if size > most:
        part = most / size
        t0, t1, t2 = part * t0, part * t1, part * t2
        drag[f, q, 0], drag[f, q, 1], drag[f, q, 2] = t0, t1, t2
        anchor[f, q, 0], anchor[f, q, 1], anchor[f, q, 2] = place
        return t0, t1, t2
    drag[f, q, 0] += follow * (t0 - drag[f, q, 0])
    drag[f, q, 1] += follow * (t1 - drag[f, q, 1])
    drag[f, q, 2] += follow * (t2 - drag[f, q, 2])
    return t0, t1, t2


@njit_inlined
def press(facets, boundary, step, state, f, q):
    """The force of the deepest obstacle on point q of facet f [N] and which obstacle; `state`: its position and speed.

    The speed is what the step would end with under the force that the point has, λ and what friction holds.
    """
    y, u = state
    dt = boundary.dt
    o, gap, normal = deepest(facets, boundary, step, (y[0] + dt * u[0], y[1] + dt * u[1], y[2] + dt * u[2]))
    place, v = boundary.position[step, o], boundary.velocity[step, o]
    if facets.contact_id[f, q] != o + 1:
        forget(facets, f, q)
        if gap < 0.0:
            facets.contact_id[f, q] = o + 1
            for axis in range(3):
                facets.anchor[f, q, axis] = y[axis] - (place[axis] - dt * v[axis])
    k = facets.stiffness[f, q] / (dt * dt)
    force = max(0.0, facets.pressing[f, q] - k * gap)
    facets.pressing[f, q] += following(boundary) * (force - facets.pressing[f, q])
    if not force > 0.0:
        forget(facets, f, q)
        return o, 0.0, 0.0, 0.0
    p0, p1, p2 = force * normal[0], force * normal[1], force * normal[2]
    if boundary.friction[o] > 0.0:
        end = y[0] + dt * u[0] - place[0], y[1] + dt * u[1] - place[1], y[2] + dt * u[2] - place[2]
        stiffness = k, following(boundary)
        t0, t1, t2 = rub(facets, f, q, stiffness, boundary.friction[o] * force, end, normal)
        p0, p1, p2 = p0 + t0, p1 + t1, p2 + t2
    return o, p0, p1, p2


@njit_inlined
def add_at_point(facets, field, force, f, q):
    """A force (3) [N] at point q of facet f: what its nodes have of it, into `field` (n, 3)."""
    for a in range(6):
        i, share = facets.node[f, a], facets.shape[q, a]
        for axis in range(3):
            field[i, axis] += share * force[axis]


@njit_inlined
def known_force(facets, boundary, step, y, f, q):
    """The force that point q of facet f had [N], λ along the normal of today and what friction holds; 0 for none."""
    if facets.contact_id[f, q] == 0:
        return 0.0, 0.0, 0.0
    o, pressing, drag = facets.contact_id[f, q] - 1, facets.pressing[f, q], facets.dragging
    place = boundary.position[step, o]
    _, n0, n1, n2 = gap_and_normal(boundary, o, y[0] - place[0], y[1] - place[1], y[2] - place[2])
    return pressing * n0 + drag[f, q, 0], pressing * n1 + drag[f, q, 1], pressing * n2 + drag[f, q, 2]


@njit_lean
def known_forces_into(nodes, facets, boundary, step, field):
    """What all points had in the last step [N], into `field` (n, 3)."""
    field[:] = 0.0
    for f in range(facets.node.shape[0]):
        for q in range(facets.shape.shape[0]):
            if facets.contact_id[f, q] > 0:
                y = at_point(nodes.x, facets.node, facets.shape[q], f)
                add_at_point(facets, field, known_force(facets, boundary, step, y, f, q), f, q)


@njit_lean
def corrections_into(nodes, facets, boundary, step, speed, field, inverse_mass, contact_impulse):
    """What changes of the forces of all points [N], into `field` (n, 3); books the impulses of the obstacles.

    `speed` (n, 4): of nodes under the forces that were known [m/s]; a correction moves it for the points that follow.
    """
    node, dt = facets.node, boundary.dt
    field[:] = 0.0
    for f in range(node.shape[0]):
        far = is_far(facets, nodes, boundary, step, f)
        for q in range(facets.shape.shape[0]):
            if far and facets.contact_id[f, q] == 0:
                continue
            weights = facets.shape[q]
            y, u = at_point(nodes.x, node, weights, f), at_point(speed, node, weights, f)
            k0, k1, k2 = known_force(facets, boundary, step, y, f, q)
            o, f0, f1, f2 = press(facets, boundary, step, (y, u), f, q)
            contact_impulse[o, 0] += dt * f0
            contact_impulse[o, 1] += dt * f1
            contact_impulse[o, 2] += dt * f2
            change = f0 - k0, f1 - k1, f2 - k2
            add_at_point(facets, field, change, f, q)
            for a in range(6):
                i = node[f, a]
                for axis in range(3):
                    speed[i, axis] += dt * inverse_mass[i] * weights[a] * change[axis]
