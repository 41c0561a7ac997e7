"""Contact between the faces of a cut: pairs of a node and its copy, without friction (docs/theory.md, section 9).

A touching pair removes one direction from the relative motion of its two nodes, after obstacles have removed theirs. No
node is in two pairs, so a division eliminates each pair, and the volumes see only a changed mobility.
"""

import math

from massspring.kernels.contact.node_contact import after_contact, allowed
from massspring.kernels.jit.decorators import compiled, njit_inlined, njit_lean
from massspring.kernels.jit.vec3 import add_to, cross, dot, minus, over, plus, put, row, take_from, times

NEGLIGIBLE = 1e-12
"""Ratio to the mobility without obstacles below which the mobility of a pair counts as round-off."""


@compiled
def normals_into(pairs, x):
    """n of all pairs: parallel to the sum of the area vectors of the triangles around both nodes (eq. 9.8)."""
    corner, pair, normal = pairs.corner, pairs.pair, pairs.normal
    normal[:] = 0.0
    for t in range(corner.shape[0]):
        for first in (0, 3):
            o = row(x, corner[t, first])
            a, b = minus(row(x, corner[t, first + 1]), o), minus(row(x, corner[t, first + 2]), o)
            for c in range(3):
                if pair[t, c] >= 0:
                    add_to(normal, pair[t, c], cross(a, b))
    for p in range(normal.shape[0]):
        n = row(normal, p)
        pairs.area[p] = math.sqrt(dot(n, n))
        put(normal, p, over(n, pairs.area[p]))


@njit_lean
def measure_pairs(pairs, x, inverse_mass):
    """Normals, gaps and levers at the start of a step; no pair touches yet. A pair farther apart than its reach
    cannot."""
    normals_into(pairs, x)
    node = pairs.node
    for p in range(node.shape[0]):
        i, j, n = node[p, 0], node[p, 1], row(pairs.normal, p)
        d = minus(row(x, j), row(x, i))
        gap = dot(n, d)
        slip = dot(d, d) - gap * gap
        near = slip < pairs.reach[p] ** 2 and gap > -pairs.reach[p]
        if pairs.touches[p] > 0 and not near:
            pairs.lost[0] += 1
        pairs.touches[p] = 0
        pairs.gap[p] = gap if near and inverse_mass[i] + inverse_mass[j] > 0.0 else math.inf
        share = pairs.impulse[p] / pairs.area[p] if pairs.gap[p] < math.inf else 0.0
        put(pairs.lever, p, times(share, minus(d, times(gap, n))))


@njit_lean
def turn_faces(pairs, x, inverse_mass, v_star, gradient):
    """v* of the faces with what the impulses of the last step do to them by their slip: the normal of a pair turns with
    the triangles around it, so they carry the couple of the pair (eq. 9.11). Returns what G·v* gains [m³/s], 0 without
    a `gradient`."""
    corner, pair, lever = pairs.corner, pairs.pair, pairs.lever
    flow = 0.0
    for t in range(corner.shape[0]):
        q = 0.0, 0.0, 0.0
        for c in range(3):
            if pair[t, c] >= 0:
                q = plus(q, row(lever, pair[t, c]))
        if q[0] == 0.0 and q[1] == 0.0 and q[2] == 0.0:
            continue
        for first in (0, 3):
            i, j, k = corner[t, first], corner[t, first + 1], corner[t, first + 2]
            o = row(x, i)
            # Q·δ(a × b) = δa·(b × Q) + δb·(Q × a)
            f, g = cross(minus(row(x, k), o), q), cross(q, minus(row(x, j), o))
            for n, h in ((i, minus(times(-1.0, f), g)), (j, f), (k, g)):
                w = inverse_mass[n]
                add_to(v_star, n, times(w, h))
                if gradient is not None:
                    flow += w * dot(row(gradient, n), h)
    return flow


@njit_inlined
def mobility_of(pairs, contacts, inverse_mass, p):
    """W̃ n of both nodes of a pair [1/kg], and 1/(n·W̃ n of both) [kg], 0 where nothing can part them."""
    i, j, n = pairs.node[p, 0], pairs.node[p, 1], row(pairs.normal, p)
    a, b = times(inverse_mass[i], allowed(contacts, i, n)), times(inverse_mass[j], allowed(contacts, j, n))
    whole = dot(n, plus(a, b))
    free = inverse_mass[i] + inverse_mass[j]
    return a, b, (1.0 / whole if whole > NEGLIGIBLE * free else 0.0)


@njit_lean
def revise_pairs(pairs, model, nodes, contacts, push, dt):
    """A pair touches if it would overlap at the end of the step without its impulse (eq. 9.9). Adds pairs that would
    overlap, releases those that would pull, and returns the number of changes.

    A uniform pressure on a quadratic face gives no force at its corners, so the sign of the impulse of a corner is
    meaningless: a corner also touches if all mid-sides around it touch.
    """
    changes = 0
    for corners in (False, True):
        for p in range(pairs.gap.shape[0]):
            if pairs.gap[p] == math.inf or corners != (pairs.side_start[p + 1] > pairs.side_start[p]):
                continue
            u = pushed_to(model, nodes, contacts, push, dt, pairs.node[p, 0])
            v = pushed_to(model, nodes, contacts, push, dt, pairs.node[p, 1])
            touches = pairs.gap[p] + dt * gap_rate(pairs, p, u, v) < 0.0 or (corners and is_enclosed(pairs, p))
            changes += touches != (pairs.touches[p] > 0)
            pairs.touches[p] = touches
    return changes


@njit_inlined
def is_enclosed(pairs, p):
    """Whether all mid-sides around corner p touch."""
    for k in range(pairs.side_start[p], pairs.side_start[p + 1]):  # noqa: SIM110 — numba compiles no generators
        if pairs.touches[pairs.side[k]] == 0:
            return False
    return True


@njit_lean
def part_faces(pairs, contacts, inverse_mass, u, dt, closing):
    """Adds to u, (n, 3 or more), the impulse of each touching pair that ends the step at gap 0 (eq. 9.10). If not
    `closing`, the gap is ignored, which turns W̃ f into Ŵ f."""
    if pairs is None:
        return
    for p in range(pairs.gap.shape[0]):
        if pairs.touches[p] == 0:
            continue
        i, j = pairs.node[p, 0], pairs.node[p, 1]
        a, b, mass = mobility_of(pairs, contacts, inverse_mass, p)
        rate = -pairs.gap[p] / dt if closing else 0.0
        k = mass * (rate - gap_rate(pairs, p, row(u, i), row(u, j)))
        take_from(u, i, times(k, a))
        add_to(u, j, times(k, b))


@njit_lean
def less_of_pairs(pairs, model, nodes, contacts, flow, mobility, dt):
    """G·v̂ [m³/s] and G·Ŵ·G [m⁴/kg] from G·ṽ and G·W̃·G, less the parts that touching pairs remove (eq. 9.10)."""
    if pairs is None:
        return flow, mobility
    gradient, v_star = nodes.gradient, nodes.v_star
    for p in range(pairs.gap.shape[0]):
        if pairs.touches[p] == 0:
            continue
        i, j = pairs.node[p, 0], pairs.node[p, 1]
        a, b, mass = mobility_of(pairs, contacts, model.inverse_mass, p)
        u, v = after_contact(contacts, i, row(v_star, i)), after_contact(contacts, j, row(v_star, j))
        share = 0.0
        for axis in range(3):
            share += gradient[j, axis] * b[axis] - gradient[i, axis] * a[axis]
        flow += share * mass * (-pairs.gap[p] / dt - gap_rate(pairs, p, u, v))
        mobility -= share * share * mass
    return flow, mobility


@njit_lean
def less_of_pairs_in(matrix, pairs, rows, contacts, inverse_mass):
    """S_rs −= h_r h_s/(n·W̃ n), h = J W̃ Nᵀ of every touching pair, in the lower triangle (m, m) (eq. 9.10)."""
    if pairs is None:
        return
    for p in range(pairs.gap.shape[0]):
        if pairs.touches[p] == 0:
            continue
        a, b, mass = mobility_of(pairs, contacts, inverse_mass, p)
        away, g = times(-1.0, a), rows.node_value
        for one in range(2):
            i, c = pairs.node[p, one], (b if one else away)
            for k in range(rows.node_start[i], rows.node_start[i + 1]):
                h = mass * dot(row(g, k), c)
                for other in range(2):
                    j, d = pairs.node[p, other], (b if other else away)
                    for q in range(rows.node_start[j], rows.node_start[j + 1]):
                        if rows.node_row[q] <= rows.node_row[k]:
                            matrix[rows.node_row[k], rows.node_row[q]] -= h * dot(row(g, q), d)


@njit_lean
def press_pairs(pairs, model, nodes, contacts, push, dt):
    """Adds the impulse k n [N s] of each touching pair to v* (eq. 9.10), so that later stages treat it as a force."""
    if pairs is None:
        return
    weights = model.inverse_mass
    for p in range(pairs.gap.shape[0]):
        pairs.impulse[p] = 0.0
        if pairs.touches[p] == 0:
            continue
        i, j, n = pairs.node[p, 0], pairs.node[p, 1], row(pairs.normal, p)
        u = pushed_to(model, nodes, contacts, push, dt, i)
        v = pushed_to(model, nodes, contacts, push, dt, j)
        _, _, mass = mobility_of(pairs, contacts, weights, p)
        k = mass * (-pairs.gap[p] / dt - gap_rate(pairs, p, u, v))
        pairs.impulse[p] = k
        take_from(nodes.v_star, i, times(k * weights[i], n))
        add_to(nodes.v_star, j, times(k * weights[j], n))


@njit_inlined
def pushed_to(model, nodes, contacts, push, dt, i):
    """Velocity of node i without the impulse of its pair [m/s]: ṽ + dt W̃ f (eq. 3.4, 3.5)."""
    w = dt * push.factor * model.inverse_mass[i]
    return after_contact(contacts, i, plus(row(nodes.v_star, i), times(w, row(push.direction, i))))


@njit_inlined
def gap_rate(pairs, p, u, v):
    """n·(v − u) of the velocities of the nodes behind and in front [m/s]."""
    return dot(row(pairs.normal, p), minus(v, u))
