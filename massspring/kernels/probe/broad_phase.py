"""Which triangles a probe may meet in a step: sleeping blocks, then axis-aligned boxes (docs/theory.md, section 11)."""

import math

from massspring.kernels.contact.node_contact import FREE, settled
from massspring.kernels.jit.decorators import njit_ignoring_nan, njit_lean
from massspring.kernels.jit.flat import flat
from massspring.kernels.jit.vec3 import dot, plus, row, times
from massspring.kernels.probe.arrays import COMPARED

TRIANGLE_BLOCK = 8
"""Triangles per sleeping block: 39,000 triangles take 4,880 comparisons per step while all sleep."""
ROOM = 3.0
"""Factor on the motion without contact within which pairs are searched: pushes add to the motion."""
SAFE = 1.0 + 1e-6
"""Factor on distances: sums over a million steps, and velocities in single precision, lose less than this."""


@njit_ignoring_nan
def fastest_free(v_star, direction, inverse_mass, impulse):
    """max_i |v*_i + impulse w_i d_i|² [m²/s²] of flat tables, without contact (eq. 3.5)."""
    fastest = v_star.dtype.type(0)
    for i in range(inverse_mass.shape[0]):
        w = impulse * inverse_mass[i]
        u0 = v_star[3 * i] + w * direction[3 * i]
        u1 = v_star[3 * i + 1] + w * direction[3 * i + 1]
        u2 = v_star[3 * i + 2] + w * direction[3 * i + 2]
        fastest = max(fastest, u0 * u0 + u1 * u1 + u2 * u2)
    return fastest


@njit_lean
def fastest_node(model, nodes, contacts, push, dt):
    """Upper bound on |v⁺_i| [m/s] over all nodes, without thin probes (eq. 3.5)."""
    n, real = model.inverse_mass.shape[0], nodes.x.dtype.type
    v_star, direction = flat(nodes.v_star, 0, n), flat(push.direction, 0, n)
    weight = flat(model.inverse_mass, 0, n)
    fastest = float(fastest_free(v_star, direction, weight, real(dt * push.factor)))
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if contacts.mode[i] > FREE:
            w = dt * push.factor * weight[i]
            u = settled(contacts, i, plus(row(nodes.v_star, i), times(w, row(push.direction, i))))
            fastest = max(fastest, dot(u, u))
    return math.sqrt(fastest)


@njit_lean
def box_gap(x, triangles, f, p):
    """Distance [m] of a point to the axis-aligned box of a triangle: never more than to the triangle (eq. 11.5)."""
    a, b, c, square = triangles[f, 0], triangles[f, 1], triangles[f, 2], 0.0
    for k in range(3):
        low, high = min(x[a, k], x[b, k], x[c, k]), max(x[a, k], x[b, k], x[c, k])
        d = max(low - p[k], p[k] - high, 0.0)
        square += d * d
    return math.sqrt(square)


@njit_lean
def find_near(nodes, tips, step, probes, reach):
    """Fills `near` with the triangles whose box may come within the radius of a tip if it moves by `reach` [m] (eq.
    11.5).

    A block whose nearest triangle is at distance g sleeps until the travel has grown by g; its boxes are not checked.
    """
    surface, reach = probes.surface, SAFE * reach
    for p in range(probes.radius.shape[0]):
        tip, count = row(tips.start[step], p), 0
        for block in range(probes.wake.shape[1]):
            if probes.skipping and probes.wake[p, block] > probes.travel[0] + reach:
                continue
            begin, end = TRIANGLE_BLOCK * block, min(TRIANGLE_BLOCK * (block + 1), surface.shape[0])
            nearest = math.inf
            for f in range(begin, end):
                gap = box_gap(nodes.x, surface, f, tip) - probes.radius[p]
                nearest = min(nearest, gap)
                if not probes.skipping or gap <= reach:
                    probes.near[p, count] = f
                    count += 1
            probes.counts[COMPARED] += end - begin
            probes.wake[p, block] = probes.travel[0] + nearest
        probes.near_count[p] = count
