"""Distance of a point from a surface, and the winding number of the surface about it."""

import math

from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.vec3 import dot, minus, put, row, triple
from massspring.kernels.probe.broad_phase import box_gap
from massspring.kernels.probe.continuous import nearest_into


@njit_lean
def distance_to(point, x, triangles, corner, weight):
    """Distance of a point (3,) to the nearest of triangles (f, 3) [m] (eq. 11.1); `corner` (3, 3) and `weight` (3,) are
    scratch.

    A triangle whose box is farther than the nearest triangle so far is skipped.
    """
    nearest, o = math.inf, (point[0], point[1], point[2])
    for f in range(triangles.shape[0]):
        if box_gap(x, triangles, f, o) < nearest:
            for k in range(3):
                put(corner, k, minus(row(x, triangles[f, k]), o))
            nearest = min(nearest, nearest_into(corner, weight))
    return nearest


@njit_lean
def winding_number_at(point, x, triangles):
    """How often a closed surface goes round a point (3,): its solid angle over 4π [1].

    Van Oosterom and Strackee (1983), equation 8: tan(Ω/2) = a·(b × c) / (|a||b||c| + a·b |c| + b·c |a| + c·a |b|).
    """
    half, o = 0.0, (point[0], point[1], point[2])
    for f in range(triangles.shape[0]):
        p, q, r = row(x, triangles[f, 0]), row(x, triangles[f, 1]), row(x, triangles[f, 2])
        p, q, r = minus(p, o), minus(q, o), minus(r, o)
        a, b, c = math.sqrt(dot(p, p)), math.sqrt(dot(q, q)), math.sqrt(dot(r, r))
        half += math.atan2(triple(p, q, r), a * b * c + dot(p, q) * c + dot(q, r) * a + dot(r, p) * b)
    return half / (2.0 * math.pi)
