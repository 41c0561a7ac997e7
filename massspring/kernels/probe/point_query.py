"""Distance of a point from a surface, and the winding number of the surface about it."""

import math

from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.probe.broad_phase import box_gap
from massspring.kernels.probe.continuous import nearest_into


@njit_lean
def distance_to(point, x, triangles, corner, weight):
    """Distance of a point (3,) to the nearest of triangles (f, 3) [m] (eq. 11.1); `corner` (3, 3) and `weight` (3,) are
    scratch.

    A triangle whose box is farther than the nearest triangle so far is skipped.
    """
    nearest = math.inf
    for f in range(triangles.shape[0]):
        if box_gap(x, triangles, f, point[0], point[1], point[2]) < nearest:
            for k in range(3):
                for axis in range(3):
                    corner[k, axis] = x[triangles[f, k], axis] - point[axis]
            nearest = min(nearest, nearest_into(corner, weight))
    return nearest


@njit_lean
def winding_number_at(point, x, triangles):
    """How often a closed surface goes round a point (3,): its solid angle over 4π [1].

    Van Oosterom and Strackee (1983), equation 8: tan(Ω/2) = a·(b × c) / (|a||b||c| + a·b |c| + b·c |a| + c·a |b|).
    """
    half = 0.0
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        a0, a1, a2 = x[i, 0] - point[0], x[i, 1] - point[1], x[i, 2] - point[2]
        b0, b1, b2 = x[j, 0] - point[0], x[j, 1] - point[1], x[j, 2] - point[2]
        c0, c1, c2 = x[k, 0] - point[0], x[k, 1] - point[1], x[k, 2] - point[2]
        a = math.sqrt(a0 * a0 + a1 * a1 + a2 * a2)
        b = math.sqrt(b0 * b0 + b1 * b1 + b2 * b2)
        c = math.sqrt(c0 * c0 + c1 * c1 + c2 * c2)
        triple = a0 * (b1 * c2 - b2 * c1) + a1 * (b2 * c0 - b0 * c2) + a2 * (b0 * c1 - b1 * c0)
        ab, bc, ca = a0 * b0 + a1 * b1 + a2 * b2, b0 * c0 + b1 * c1 + b2 * c2, c0 * a0 + c1 * a1 + c2 * a2
        half += math.atan2(triple, a * b * c + ab * c + bc * a + ca * b)
    return half / (2.0 * math.pi)
