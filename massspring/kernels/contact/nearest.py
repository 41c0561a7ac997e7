"""The point of a facet, straight or curved, nearest to the axis of a round obstacle: a segment, of a sphere a point.

Corners and nodes are relative to the start of the axis, `a` is the way to its end [m].
"""

import math

from massspring.kernels.contact.node_contact import axis_share
from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.vec3 import cross, dot, minus, plus, row, times, triple

ROUNDS, HALVINGS = 40, 12
"""Most steps of the search on a curved facet, and of halving one that does not come nearer."""
NEARER = 1e-9
"""Share of the distance that a step must gain for another one."""


@njit_inlined
def foot(p, q, r, o):
    """Squared distance of o to the plane of a triangle and the weights of its foot; infinity where this is outside."""
    b, c = minus(q, p), minus(r, p)
    n, d = cross(b, c), minus(o, p)
    area = dot(n, n)
    if area > 0.0:
        v, w = triple(d, c, n) / area, triple(b, d, n) / area
        if v >= 0.0 and w >= 0.0 and v + w <= 1.0:
            height = dot(d, n)
            return height * height / area, v, w
    return math.inf, 0.0, 0.0


@njit_inlined
def between(p, q, a):
    """Share of the way from p to q at which it is nearest to the segment 0 … a (Ericson 2005, section 5.1.9)."""
    d = minus(q, p)
    length, along, slope = dot(d, d), dot(a, a), dot(a, d)
    apart = along * length - slope * slope
    s = 0.0
    if apart > 0.0:
        s = min(max((dot(a, p) * length - slope * dot(d, p)) / apart, 0.0), 1.0)
    t = axis_share(minus(times(s, a), p), d)
    return axis_share(minus(times(axis_share(plus(p, times(t, d)), a), a), p), d)


@njit_lean
def nearest_of_triangle(p, q, r, a):
    """Squared distance [m²] of a triangle to the segment 0 … a, and the weights of its nearest point. Exact: on a side,
    above an end of the segment, or where this passes through."""
    best, v, w = foot(p, q, r, (0.0, 0.0, 0.0))
    long = dot(a, a) > 0.0
    if long:
        square, v1, w1 = foot(p, q, r, a)
        if square < best:
            best, v, w = square, v1, w1
        n = cross(minus(q, p), minus(r, p))
        rise = dot(a, n)
        s = dot(p, n) / rise if rise != 0.0 else -1.0
        if 0.0 <= s <= 1.0:
            square, v1, w1 = foot(p, q, r, times(s, a))
            if square < best:
                best, v, w = 0.0, v1, w1
    for side in range(3):
        b, c = (p, q) if side == 0 else ((q, r) if side == 1 else (r, p))
        t = between(b, c, a) if long else axis_share(times(-1.0, b), minus(c, b))
        y = plus(b, times(t, minus(c, b)))
        y = minus(y, times(axis_share(y, a), a))
        square = dot(y, y)
        if square < best:
            best = square
            v, w = (t, 0.0) if side == 0 else ((1.0 - t, t) if side == 1 else (0.0, 1.0 - t))
    return best, (1.0 - v - w, v, w)


@njit_inlined
def shape_at(b):
    """Quadratic shape functions of corners and mid-sides at three barycentric coordinates b."""
    return (
        b[0] * (2.0 * b[0] - 1.0),
        b[1] * (2.0 * b[1] - 1.0),
        b[2] * (2.0 * b[2] - 1.0),
        4.0 * b[0] * b[1],
        4.0 * b[1] * b[2],
        4.0 * b[2] * b[0],
    )


@njit_inlined
def on_facet(x, node, f, o, b):
    """The point of facet f (6 nodes) at barycentric coordinates b, relative to o [m]."""
    y, weights = times(-1.0, o), shape_at(b)
    for k in range(6):
        y = plus(y, times(weights[k], row(x, node[f, k])))
    return y


@njit_inlined
def slope_of(x, node, f, b, k):
    """∂y/∂b_k of facet f [m]."""
    j, i = (k + 1) % 3, (k + 2) % 3
    y = times(4.0 * b[k] - 1.0, row(x, node[f, k]))
    y = plus(y, times(4.0 * b[j], row(x, node[f, 3 + k])))
    return plus(y, times(4.0 * b[i], row(x, node[f, 3 + i])))


@njit_inlined
def square_to(y, a):
    """Squared distance of y to the segment 0 … a [m²]."""
    y = minus(y, times(axis_share(y, a), a))
    return dot(y, y)


@njit_inlined
def first_guess(x, node, f, o, a):
    """The nearest point of the four flat parts of facet f, as barycentric coordinates of the facet."""
    best, b = math.inf, (0.0, 0.0, 0.0)
    for part in range(4):
        # Corner `part` and the middles of its two sides; the last part has the three middles.
        j = (part + 2) % 3
        first = row(x, node[f, part if part < 3 else 4])
        second, third = row(x, node[f, 3 + part % 3]), row(x, node[f, 3 + j])
        square, u = nearest_of_triangle(minus(first, o), minus(second, o), minus(third, o), a)
        if square < best:
            best = square
            # In the order of the corners k, i, j: k is `part`, of the last one 0.
            near, of_i, of_j = u[0] + 0.5 * (u[1] + u[2]), 0.5 * u[1], 0.5 * u[2]
            if part == 3:
                near, of_i, of_j = 0.5 * (u[1] + u[2]), 0.5 * (u[0] + u[1]), 0.5 * (u[0] + u[2])
            k = part % 3
            b = (near, of_i, of_j) if k == 0 else ((of_j, near, of_i) if k == 1 else (of_i, of_j, near))
    return b


@njit_lean
def nearest_of_facet(x, node, f, o, a):
    """Squared distance [m²] of facet f to the segment o … o + a, and the barycentric coordinates of its nearest point.

    `node` (f, 3) or (f, 6). Straight facets: exact. Curved ones: from the nearest of the four flat parts by steps to
    the nearest point of the tangential triangle (Gauss and Newton), each halved until it comes nearer.
    """
    if node.shape[1] == 3:
        p, q, r = row(x, node[f, 0]), row(x, node[f, 1]), row(x, node[f, 2])
        return nearest_of_triangle(minus(p, o), minus(q, o), minus(r, o), a)
    b = first_guess(x, node, f, o, a)
    y = on_facet(x, node, f, o, b)
    best = square_to(y, a)
    for _ in range(ROUNDS):
        t0, t1, t2 = slope_of(x, node, f, b, 0), slope_of(x, node, f, b, 1), slope_of(x, node, f, b, 2)
        base = minus(y, plus(plus(times(b[0], t0), times(b[1], t1)), times(b[2], t2)))
        _, to = nearest_of_triangle(plus(base, t0), plus(base, t1), plus(base, t2), a)
        step, before = minus(to, b), best
        for _ in range(HALVINGS):
            there = plus(b, step)
            z = on_facet(x, node, f, o, there)
            square = square_to(z, a)
            if square < best:
                best, b, y = square, there, z
                break
            step = times(0.5, step)
        if not best < (1.0 - NEARER) * before:
            break
    return best, b


@njit_inlined
def box_square(x, node, f, o, a):
    """Squared distance [m²] between the boxes of facet f, of a curved one of its Bézier points, and of the segment
    o … o + a."""
    square = 0.0
    for axis in range(3):
        low, high = math.inf, -math.inf
        for k in range(3):
            c = x[node[f, k], axis]
            low, high = min(low, c), max(high, c)
            if node.shape[1] == 6:
                c = 2.0 * x[node[f, 3 + k], axis] - 0.5 * (c + x[node[f, (k + 1) % 3], axis])
                low, high = min(low, c), max(high, c)
        apart = max(low - o[axis] - max(a[axis], 0.0), o[axis] + min(a[axis], 0.0) - high, 0.0)
        square += apart * apart
    return square


@njit_lean
def distance_to_axis(x, node, o, a):
    """Distance [m] of the facets `node` (f, 3 or 6) between `x` (n, 3) to the segment o … o + a (3,)."""
    best, begin, way = math.inf, row_of(o), row_of(a)
    for f in range(node.shape[0]):
        if box_square(x, node, f, begin, way) < best:
            best = min(best, nearest_of_facet(x, node, f, begin, way)[0])
    return math.sqrt(best)


@njit_lean
def within_into(x, node, o, a, reach, near):
    """Writes into `near` (f,) bool which of the facets `node` (f, 3 or 6) come within `reach` [m] of the segment o …
    o + a (3,)."""
    begin, way, square = row_of(o), row_of(a), reach * reach
    for f in range(node.shape[0]):
        near[f] = box_square(x, node, f, begin, way) <= square
        if near[f]:
            near[f] = nearest_of_facet(x, node, f, begin, way)[0] <= square


@njit_inlined
def row_of(vector):
    """A vector (3,) as a tuple."""
    return vector[0], vector[1], vector[2]


@njit_lean
def passes_surface(p, q, r, x, triangles):
    """Whether the triangle p, q, r (3,), perhaps a segment, meets one of `triangles` (f, 3) between `x` (n, 3): a side
    of either passes through the other."""
    p, q, r = row_of(p), row_of(q), row_of(r)
    for f in range(triangles.shape[0]):
        b, c, d = row(x, triangles[f, 0]), row(x, triangles[f, 1]), row(x, triangles[f, 2])
        for side in range(3):
            u, v = (p, q) if side == 0 else ((q, r) if side == 1 else (r, p))
            if passes(b, c, d, u, v):
                return True
            u, v = (b, c) if side == 0 else ((c, d) if side == 1 else (d, b))
            if passes(p, q, r, u, v):
                return True
    return False


@njit_inlined
def passes(p, q, r, u, v):
    """Whether the segment from u to v passes through a triangle, sides included."""
    a, n = minus(v, u), cross(minus(q, p), minus(r, p))
    rise = dot(a, n)
    if rise == 0.0:
        return False
    s = dot(minus(p, u), n) / rise
    return 0.0 <= s <= 1.0 and foot(p, q, r, plus(u, times(s, a)))[0] < math.inf
