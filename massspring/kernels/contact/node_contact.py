"""Contact modes, positions of a node relative to an obstacle, and the motion that contact allows it.

Most functions take numbers, not arrays, so that nodes, points of probes and loops over all nodes can share them, in
either precision.
"""

import math

from massspring.kernels.jit.decorators import compiled, njit_inlined, njit_lean
from massspring.kernels.jit.vec3 import dot, minus, over, plus, put, row, times

FREE, SLIDES, ON_EDGE, STICKS, HIDDEN = range(5)
"""FREE: none. SLIDES: one, the normal of one obstacle. ON_EDGE: two, the node slides along the edge in which two
obstacles meet. STICKS: all three. HIDDEN: none, and the search for contacts leaves the node out."""


@njit_lean
def allowed_part(mode, d, g):
    """P g, the part of a vector that obstacles allow: P = I − n nᵀ on one, e eᵀ on two, 0 where a node sticks (eq.
    3.4)."""
    along = dot(g, d)
    if mode == SLIDES:
        return minus(g, times(along, d))
    if mode == ON_EDGE:
        return times(along, d)
    return 0.0, 0.0, 0.0


@njit_lean
def taken_share(mode, d, g, v):
    """g·(I − P) v, the part of a product that obstacles remove (eq. 3.4)."""
    along = dot(g, d) * dot(v, d)
    if mode == SLIDES:
        return along
    whole = dot(g, v)
    return whole - along if mode == ON_EDGE else whole


@njit_lean
def axis_share(r, s):
    """Where on a segment 0 … s the point nearest to r lies, 0 … 1; 0 where s has no length.

    Constants have the type of the arguments: a float64 constant among float32 numbers makes the loop over all nodes
    three times slower.
    """
    square = dot(s, s)
    real = type(square)
    zero, one = real(0.0), real(1.0)
    return min(max(dot(r, s) / square, zero), one) if square > zero else zero


@njit_lean
def round_gap(r, a, radius):
    """Distance [m] of r to the axis 0 … a less a radius, negative inside (eq. 3.7)."""
    off = minus(r, times(axis_share(r, a), a))
    return math.sqrt(dot(off, off)) - radius


@njit_lean
def sphere_contact(s, r, radius):
    """(normal, lift) of a node at s now and at r after the predicted step, both relative to the centre [m] (eq. 3.7).

    n = s/|s|; the node ends the step at n·r⁺ = n·r + lift = √(R² − |r − n (n·r)|²), on the sphere, moved along n alone.
    A node that slides farther than R within a step has no such point: it ends on the tangent plane at r/|r|. At the
    centre inverse lengths are infinite; the run has then diverged.
    """
    distance, now = math.sqrt(dot(r, r)), math.sqrt(dot(s, s))
    along = dot(r, s) / now if now > 0.0 else 0.0
    below = radius * radius - (distance * distance - along * along)
    if along > 0.0 and below > 0.0:
        return over(s, now), math.sqrt(below) - along
    return over(r, distance), radius - distance


@njit_lean
def round_contact(s, r, a, radius):
    """`sphere_contact` with the sphere around the nearest point of an axis 0 … a, a capsule's; a = 0: a sphere's.

    Along the side both points are relative to the axis. A node that passes from side to end ends on the tangent plane.
    """
    now, then = axis_share(s, a), axis_share(r, a)
    r = minus(r, times(then, a))
    if now == then or (0.0 < now < 1.0 and 0.0 < then < 1.0):
        return sphere_contact(minus(s, times(now, a)), r, radius)
    return sphere_contact(r, r, radius)


@compiled
def unpushed_into(nodes, contacts, dt, y):
    """y = x + dt ṽ [m], (n, 3): where the step ends without pressure, contact included (eq. 3.4, 3.5)."""
    for i in range(y.shape[0]):
        put(y, i, plus(row(nodes.x, i), times(dt, after_contact(contacts, i, row(nodes.v_star, i)))))


@compiled
def pushed_by_into(contacts, inverse_mass, factor, force, d):
    """d = factor · W̃ F, (n, 3): displacement by a force on every node, with contact and held nodes (eq. 3.4)."""
    for i in range(d.shape[0]):
        put(d, i, allowed(contacts, i, times(factor * inverse_mass[i], row(force, i))))


@njit_inlined
def allowed(contacts, i, g):
    """The part of a vector that obstacles leave to node i (eq. 3.4)."""
    if contacts.mode[i] > FREE:
        return allowed_part(contacts.mode[i], row(contacts.direction, i), g)
    return g


@njit_inlined
def settled(contacts, i, u):
    """Velocity of a touched node after contact [m/s], P u + v_target (eq. 3.5)."""
    return plus(allowed_part(contacts.mode[i], row(contacts.direction, i), u), row(contacts.v_target, i))


@njit_inlined
def after_contact(contacts, i, u):
    """Velocity of any node after contact [m/s]: u of a free one (eq. 3.5)."""
    if contacts.mode[i] > FREE:
        return settled(contacts, i, u)
    return u


@njit_inlined
def moved_by(contacts, inverse_mass, i, g):
    """W̃ g at node i (eq. 3.4)."""
    return allowed(contacts, i, times(inverse_mass[i], g))
