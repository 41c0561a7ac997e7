"""Position of a node relative to an obstacle, and the motion that contact allows it.

These functions take numbers, not arrays, so that nodes, points of probes and loops over all nodes can share them, in
either precision.
"""

import math

from massspring.kernels.contact.modes import ON_EDGE, SLIDES
from massspring.kernels.jit.decorators import njit_lean


@njit_lean
def allowed_part(mode, d0, d1, d2, g0, g1, g2):
    """P g, the part of a vector that obstacles allow: P = I − n nᵀ on one, e eᵀ on two, 0 where a node sticks (eq.
    3.4)."""
    along = g0 * d0 + g1 * d1 + g2 * d2
    if mode == SLIDES:
        return g0 - along * d0, g1 - along * d1, g2 - along * d2
    if mode == ON_EDGE:
        return along * d0, along * d1, along * d2
    return 0.0, 0.0, 0.0


@njit_lean
def taken_share(mode, d, g, v):
    """g·(I − P) v, the part of a product that obstacles remove (eq. 3.4)."""
    along = (g[0] * d[0] + g[1] * d[1] + g[2] * d[2]) * (v[0] * d[0] + v[1] * d[1] + v[2] * d[2])
    if mode == SLIDES:
        return along
    whole = g[0] * v[0] + g[1] * v[1] + g[2] * v[2]
    return whole - along if mode == ON_EDGE else whole


@njit_lean
def axis_share(r0, r1, r2, s0, s1, s2):
    """Where on a segment 0 … s the point nearest to r lies, 0 … 1; 0 where s has no length.

    Constants have the type of the arguments: a float64 constant among float32 numbers makes the loop over all nodes
    three times slower.
    """
    square = s0 * s0 + s1 * s1 + s2 * s2
    real = type(square)
    zero, one = real(0.0), real(1.0)
    return min(max((r0 * s0 + r1 * s1 + r2 * s2) / square, zero), one) if square > zero else zero


@njit_lean
def round_gap(r0, r1, r2, a0, a1, a2, radius):
    """Distance [m] of r to the axis 0 … a less a radius, negative inside (eq. 3.7)."""
    share = axis_share(r0, r1, r2, a0, a1, a2)
    r0, r1, r2 = r0 - share * a0, r1 - share * a1, r2 - share * a2
    return math.sqrt(r0 * r0 + r1 * r1 + r2 * r2) - radius


@njit_lean
def sphere_contact(s, r, radius):
    """(normal, lift) of a node at s now and at r after the predicted step, both relative to the centre [m] (eq. 3.7).

    n = s/|s|; the node ends the step at n·r⁺ = n·r + lift = √(R² − |r − n (n·r)|²), on the sphere, moved along n alone.
    A node that slides farther than R within a step has no such point: it ends on the tangent plane at r/|r|. At the
    centre inverse lengths are infinite; the run has then diverged.
    """
    s0, s1, s2 = s
    r0, r1, r2 = r
    distance = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
    now = math.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
    along = (r0 * s0 + r1 * s1 + r2 * s2) / now if now > 0.0 else 0.0
    below = radius * radius - (distance * distance - along * along)
    if along > 0.0 and below > 0.0:
        return s0 / now, s1 / now, s2 / now, math.sqrt(below) - along
    return r0 / distance, r1 / distance, r2 / distance, radius - distance


@njit_lean
def round_contact(s, r, a, radius):
    """`sphere_contact` with the sphere around the nearest point of an axis 0 … a, a capsule's; a = 0: a sphere's.

    Along the side both points are relative to the axis. A node that passes from side to end ends on the tangent plane.
    """
    now = axis_share(s[0], s[1], s[2], a[0], a[1], a[2])
    then = axis_share(r[0], r[1], r[2], a[0], a[1], a[2])
    r = r[0] - then * a[0], r[1] - then * a[1], r[2] - then * a[2]
    if now == then or (0.0 < now < 1.0 and 0.0 < then < 1.0):
        return sphere_contact((s[0] - now * a[0], s[1] - now * a[1], s[2] - now * a[2]), r, radius)
    return sphere_contact(r, r, radius)
