"""Which triangles a probe may meet in a step: sleeping pairs, then axis-aligned boxes (docs/theory.md, section 11)."""

import math

from massspring.kernels.compiled import lean
from massspring.kernels.distances import allowed_part
from massspring.kernels.probe_layout import COMPARED

TRIANGLE_BLOCK = 64
"""Triangles that share one look: 39,000 triangles are 610 numbers a step while all sleep."""
ROOM = 3.0
"""How much farther pairs are looked for than the motion without contact goes: pushes add to it."""
SAFE = 1.0 + 1e-9
"""Sums of distances over a million steps lose less than this."""


@lean
def fastest_node(network, motion, lam, dt):
    """max_i |v⁺_i| [m/s] of the step as it stands, without thin probes (eq. 10)."""
    fastest = 0.0
    for i in range(network.inverse_mass.shape[0]):
        push = dt * lam * network.inverse_mass[i]
        u0 = motion.v_star[i, 0] + push * motion.gradient[i, 0]
        u1 = motion.v_star[i, 1] + push * motion.gradient[i, 1]
        u2 = motion.v_star[i, 2] + push * motion.gradient[i, 2]
        if motion.locked[i] > 0:
            d0, d1, d2 = motion.direction[i, 0], motion.direction[i, 1], motion.direction[i, 2]
            u0, u1, u2 = allowed_part(motion.locked[i], d0, d1, d2, u0, u1, u2)
            u0, u1, u2 = u0 + motion.goal[i, 0], u1 + motion.goal[i, 1], u2 + motion.goal[i, 2]
        fastest = max(fastest, u0 * u0 + u1 * u1 + u2 * u2)
    return math.sqrt(fastest)


@lean
def box_gap(x, triangles, f, p0, p1, p2):
    """Distance [m] of a point to the axis-aligned box of a triangle: never more than to the triangle (eq. 145)."""
    a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
    d0 = max(min(x[a, 0], x[b, 0], x[c, 0]) - p0, p0 - max(x[a, 0], x[b, 0], x[c, 0]), 0.0)
    d1 = max(min(x[a, 1], x[b, 1], x[c, 1]) - p1, p1 - max(x[a, 1], x[b, 1], x[c, 1]), 0.0)
    d2 = max(min(x[a, 2], x[b, 2], x[c, 2]) - p2, p2 - max(x[a, 2], x[b, 2], x[c, 2]), 0.0)
    return math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)


@lean
def find_near(network, motion, tips, step, probes, reach):
    """Fills `near` with the triangles whose box may come within the radius of a tip in `reach` [m] of motion (eq. 145).

    A pair g apart sleeps until the travel has grown by g: no box is looked at before.
    """
    triangles = network.triangles
    horizon = probes.travel[0] + SAFE * reach
    for p in range(probes.radius.shape[0]):
        p0, p1, p2 = tips.start[step, p, 0], tips.start[step, p, 1], tips.start[step, p, 2]
        count = 0
        for block in range(probes.block_wake.shape[1]):
            if probes.skipping and probes.block_wake[p, block] > horizon:
                continue
            earliest = math.inf
            for f in range(TRIANGLE_BLOCK * block, min(TRIANGLE_BLOCK * (block + 1), triangles.shape[0])):
                if not probes.skipping or probes.wake[p, f] <= horizon:
                    gap = box_gap(motion.x, triangles, f, p0, p1, p2) - probes.radius[p]
                    probes.wake[p, f] = probes.travel[0] + gap
                    probes.counts[COMPARED] += 1
                    if not probes.skipping or gap <= SAFE * reach:
                        probes.near[p, count] = f
                        count += 1
                earliest = min(earliest, probes.wake[p, f])
            probes.block_wake[p, block] = earliest
        probes.near_count[p] = count
