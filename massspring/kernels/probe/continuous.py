"""When and where a moving point and a moving triangle meet (docs/theory.md, section 11).

All corners are relative to the point, so the point rests at the origin and a pair is two arrays (3, 3).
"""

import math
from typing import NamedTuple

import numpy as np

from massspring.kernels.contact.node_contact import axis_share
from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.vec3 import cross, dot, minus, over, plus, put, row, times, triple

NEVER = 2.0
"""Time of a meeting that does not happen within the step, whose times run from 0 to 1."""
ROUND_OFF = 1e-14
"""Share of size³ below which a triple product of corners counts as round-off, that of some thirty operations."""
ON = 1e-8
"""Share of the size within which a point counts as on a triangle: a double root of (11.2) is accurate to the square
root of round-off."""
HALVINGS = 60
"""Halvings of an interval with one root: down to the last bit."""
CREEPS = 200
"""Most steps of the conservative advance; a pair that is still undecided then counts as in contact."""


@by_address
class Pair(NamedTuple):
    """One point and one triangle during a step, and where they meet."""

    tip: np.ndarray
    """The point at the start of the step and at its end [m], (2, 3)."""
    begin: np.ndarray
    """Corners relative to the point at the start of the step [m], (3, 3)."""
    end: np.ndarray
    """The same at its end [m], (3, 3)."""
    corner: np.ndarray
    """The same in between: scratch, (3, 3)."""
    weight: np.ndarray
    """Barycentric weights of the meeting point, (3,)."""
    direction: np.ndarray
    """Unit vector from the point into the triangle, (3,)."""


@njit_lean
def nearest_into(corner, weight):
    """Weights (3,) of the point of a triangle (3, 3) nearest to the origin; returns its distance [m] (eq. 11.1).

    The nearest of the foot on the plane, if inside, and of the three edges; correct for degenerate triangles too.
    """
    o, best = row(corner, 0), math.inf
    b, c = minus(row(corner, 1), o), minus(row(corner, 2), o)
    n = cross(b, c)
    area = dot(n, n)
    if area > 0.0:
        v = -dot(cross(o, c), n) / area
        w = -dot(cross(b, o), n) / area
        if v >= 0.0 and w >= 0.0 and v + w <= 1.0:
            q = plus(plus(o, times(v, b)), times(w, c))
            best = dot(q, q)
            weight[0], weight[1], weight[2] = 1.0 - v - w, v, w
    for k in range(3):
        j, p = (k + 1) % 3, row(corner, k)
        s = minus(row(corner, j), p)
        share = axis_share(times(-1.0, p), s)
        q = plus(p, times(share, s))
        square = dot(q, q)
        if square < best:
            best = square
            weight[k], weight[j], weight[3 - k - j] = 1.0 - share, share, 0.0
    return math.sqrt(best)


@njit_lean
def coplanarity(begin, move):
    """Coefficients of (a + t a') · ((b + t b') × (c + t c')) = f0 + f1 t + f2 t² + f3 t³ [m³] (eq. 11.2).

    f is six times the volume of the tetrahedron of point and triangle; it changes sign as the point crosses the plane.
    """
    a, b, c = row(begin, 0), row(begin, 1), row(begin, 2)
    p, q, r = row(move, 0), row(move, 1), row(move, 2)
    f1 = triple(p, b, c) + triple(a, q, c) + triple(a, b, r)
    f2 = triple(a, q, r) + triple(p, b, r) + triple(p, q, c)
    return triple(a, b, c), f1, f2, triple(p, q, r)


@njit_lean
def turning_points(f1, f2, f3):
    """Times in (0, 1) at which f0 + f1 t + f2 t² + f3 t³ turns, ascending; NEVER for one that is not there."""
    root = f2 * f2 - 3.0 * f1 * f3
    if not root > 0.0:
        return NEVER, NEVER
    # Both roots use a sum of terms of equal sign: no digits are lost, and nothing is divided by f3 = 0.
    q = -(f2 + math.copysign(math.sqrt(root), f2))
    first = f1 / q if q != 0.0 else NEVER
    second = q / (3.0 * f3) if f3 != 0.0 else NEVER
    first = first if 0.0 < first < 1.0 else NEVER
    second = second if 0.0 < second < 1.0 else NEVER
    return min(first, second), max(first, second)


@njit_lean
def single_root(low, high, f0, f1, f2, f3):
    """The root of f0 + f1 t + f2 t² + f3 t³ between `low` and `high`, where the signs differ, by bisection (eq.
    11.2)."""
    rising = f0 + low * (f1 + low * (f2 + low * f3)) < 0.0
    for _ in range(HALVINGS):
        t = 0.5 * (low + high)
        if (f0 + t * (f1 + t * (f2 + t * f3)) < 0.0) == rising:
            low = t
        else:
            high = t
    return high


@njit_lean
def at_time(pair, t):
    """Corners at time t of the step, in `pair.corner`."""
    for k in range(3):
        put(pair.corner, k, plus(times(1.0 - t, row(pair.begin, k)), times(t, row(pair.end, k))))


@njit_lean
def point_along(pair, sign):
    """Makes `direction` the triangle's unit normal times `sign`; without area or sign, against its motion
    (eq. 11.3)."""
    o = row(pair.corner, 0)
    b, c = minus(row(pair.corner, 1), o), minus(row(pair.corner, 2), o)
    d = times(sign, cross(b, c))
    length = math.sqrt(dot(d, d))
    if not length > ROUND_OFF * max(dot(b, b), dot(c, c)):
        d = (0.0, 0.0, 0.0)
        for k in range(3):
            d = minus(d, times(pair.weight[k], minus(row(pair.end, k), row(pair.begin, k))))
        length = math.sqrt(dot(d, d))
    if length > 0.0:
        d = over(d, length)
    pair.direction[0], pair.direction[1], pair.direction[2] = d


@njit_lean
def touching(pair, radius):
    """First time at which the triangle is within `radius` [m] of the point, by steps that cannot overshoot (eq. 11.4).

    The distance shrinks no faster than the fastest corner moves. `direction` points from the point to the nearest one.
    """
    fastest, size = 0.0, 0.0
    for k in range(3):
        s = minus(row(pair.end, k), row(pair.begin, k))
        fastest = max(fastest, math.sqrt(dot(s, s)))
        for axis in range(3):
            size = max(size, abs(pair.begin[k, axis]), abs(pair.end[k, axis]))
    t, distance = 0.0, math.inf
    for _ in range(CREEPS):
        at_time(pair, t)
        distance = nearest_into(pair.corner, pair.weight)
        if distance <= radius + ON * size:
            break
        if t == 1.0:
            return NEVER
        t = min(1.0, t + (distance - radius) / fastest) if fastest > 0.0 else 1.0
    point_to(pair, pair.corner, distance)
    if not distance > ON * size:
        point_along(pair, 0.0)
    return t


@njit_lean
def passes_by(pair):
    """Whether one coordinate has the same sign at all corners throughout the step; then nothing crosses (eq. 11.2)."""
    apart, size = 0.0, 0.0
    for axis in range(3):
        low = min(pair.begin[0, axis], pair.begin[1, axis], pair.begin[2, axis])
        low = min(low, pair.end[0, axis], pair.end[1, axis], pair.end[2, axis])
        high = max(pair.begin[0, axis], pair.begin[1, axis], pair.begin[2, axis])
        high = max(high, pair.end[0, axis], pair.end[1, axis], pair.end[2, axis])
        apart, size = max(apart, low, -high), max(size, -low, high)
    return apart > 2.0 * ON * size


@njit_lean
def stays_off(corner, distance):
    """Whether one coordinate of the corners (3, 3) proves that the triangle is more than `distance` [m] from the
    origin."""
    apart = 0.0
    for axis in range(3):
        low = min(corner[0, axis], corner[1, axis], corner[2, axis])
        high = max(corner[0, axis], corner[1, axis], corner[2, axis])
        apart = max(apart, low, -high)
    return apart * (1.0 - ON) > distance


@njit_lean
def crossing(pair):
    """First time at which the point passes through the triangle, or NEVER: roots of (11.2) at which it lies inside.

    Edges and corners belong to the triangle, so that no path slips between two of them. A point that moves in the plane
    of the triangle has no root; `touching` finds its contact with the edge.
    """
    size = 0.0
    for k in range(3):
        for axis in range(3):
            size = max(size, abs(pair.begin[k, axis]), abs(pair.end[k, axis]))
            pair.corner[k, axis] = pair.end[k, axis] - pair.begin[k, axis]
    f0, f1, f2, f3 = coplanarity(pair.begin, pair.corner)
    noise = ROUND_OFF * size * size * size
    if max(abs(f0), abs(f1), abs(f2), abs(f3)) <= noise:
        return touching(pair, 0.0)
    first, second = turning_points(f1, f2, f3)
    low, before = 0.0, f0
    for part in range(3):
        high = min(first, 1.0) if part == 0 else (min(second, 1.0) if part == 1 else 1.0)
        after = f0 + high * (f1 + high * (f2 + high * f3))
        t = NEVER
        if (before < 0.0 < after) or (after < 0.0 < before):
            t = single_root(low, high, f0, f1, f2, f3)
        elif abs(after) <= noise:
            t = high
        if t <= 1.0:
            at_time(pair, t)
            if nearest_into(pair.corner, pair.weight) <= ON * size:
                point_along(pair, math.copysign(1.0, before) if abs(before) > noise else 0.0)
                return t
        if high == 1.0:
            break
        low, before = high, after
    return NEVER


@njit_lean
def point_to(pair, corner, distance):
    """Makes `direction` that from the point to the meeting point of `corner` (3, 3), which is `distance` [m] away."""
    for axis in range(3):
        pair.direction[axis] = 0.0
        for k in range(3):
            pair.direction[axis] += pair.weight[k] * corner[k, axis] / distance
