"""Contact between the faces of a cut: pairs of a node and its copy, without friction (docs/theory.md, section 9).

A touching pair removes one direction from the relative motion of its two nodes, after obstacles have removed theirs. No
node is in two pairs, so a division eliminates each pair, and the volumes see only a changed mobility.
"""

import math

from massspring.kernels.contact.bookkeeping import settled
from massspring.kernels.contact.modes import FREE
from massspring.kernels.contact.node_contact import allowed_part
from massspring.kernels.jit.decorators import compiled, njit_inlined, njit_lean

NEGLIGIBLE = 1e-12
"""Ratio to the mobility without obstacles below which the mobility of a pair counts as round-off."""


@compiled
def normals_into(pairs, x):
    """n of all pairs: parallel to the sum of the area vectors of the triangles around both nodes (eq. 9.8)."""
    corner, pair, normal = pairs.corner, pairs.pair, pairs.normal
    normal[:] = 0.0
    for t in range(corner.shape[0]):
        for first in (0, 3):
            i, j, k = corner[t, first], corner[t, first + 1], corner[t, first + 2]
            a0, a1, a2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
            b0, b1, b2 = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
            for c in range(3):
                p = pair[t, c]
                if p >= 0:
                    normal[p, 0] += a1 * b2 - a2 * b1
                    normal[p, 1] += a2 * b0 - a0 * b2
                    normal[p, 2] += a0 * b1 - a1 * b0
    for p in range(normal.shape[0]):
        size = math.sqrt(normal[p, 0] ** 2 + normal[p, 1] ** 2 + normal[p, 2] ** 2)
        pairs.area[p] = size
        for axis in range(3):
            normal[p, axis] /= size


@njit_lean
def measure_pairs(pairs, x, inverse_mass):
    """Normals, gaps and levers at the start of a step; no pair touches yet. A pair farther apart than its reach
    cannot."""
    normals_into(pairs, x)
    node, normal = pairs.node, pairs.normal
    for p in range(node.shape[0]):
        i, j = node[p, 0], node[p, 1]
        d0, d1, d2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        gap = normal[p, 0] * d0 + normal[p, 1] * d1 + normal[p, 2] * d2
        slip = d0 * d0 + d1 * d1 + d2 * d2 - gap * gap
        near = slip < pairs.reach[p] ** 2 and gap > -pairs.reach[p]
        if pairs.touches[p] > 0 and not near:
            pairs.lost[0] += 1
        pairs.touches[p] = 0
        pairs.gap[p] = gap if near and inverse_mass[i] + inverse_mass[j] > 0.0 else math.inf
        share = pairs.impulse[p] / pairs.area[p] if pairs.gap[p] < math.inf else 0.0
        pairs.lever[p, 0] = share * (d0 - gap * normal[p, 0])
        pairs.lever[p, 1] = share * (d1 - gap * normal[p, 1])
        pairs.lever[p, 2] = share * (d2 - gap * normal[p, 2])


@njit_lean
def turn_faces(pairs, x, inverse_mass, v_star, gradient):
    """v* of the faces with what the impulses of the last step do to them by their slip: the normal of a pair turns with
    the triangles around it, so they carry the couple of the pair (eq. 9.11). Returns what G·v* gains [m³/s], 0 without
    a `gradient`."""
    corner, pair, lever = pairs.corner, pairs.pair, pairs.lever
    flow = 0.0
    for t in range(corner.shape[0]):
        q0, q1, q2 = 0.0, 0.0, 0.0
        for c in range(3):
            p = pair[t, c]
            if p >= 0:
                q0, q1, q2 = q0 + lever[p, 0], q1 + lever[p, 1], q2 + lever[p, 2]
        if q0 == 0.0 and q1 == 0.0 and q2 == 0.0:
            continue
        for first in (0, 3):
            i, j, k = corner[t, first], corner[t, first + 1], corner[t, first + 2]
            a0, a1, a2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
            b0, b1, b2 = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
            # Q·δ(a × b) = δa·(b × Q) + δb·(Q × a)
            f0, f1, f2 = b1 * q2 - b2 * q1, b2 * q0 - b0 * q2, b0 * q1 - b1 * q0
            g0, g1, g2 = q1 * a2 - q2 * a1, q2 * a0 - q0 * a2, q0 * a1 - q1 * a0
            for n, h0, h1, h2 in ((i, -f0 - g0, -f1 - g1, -f2 - g2), (j, f0, f1, f2), (k, g0, g1, g2)):
                w = inverse_mass[n]
                v_star[n, 0] += w * h0
                v_star[n, 1] += w * h1
                v_star[n, 2] += w * h2
                if gradient is not None:
                    flow += w * (gradient[n, 0] * h0 + gradient[n, 1] * h1 + gradient[n, 2] * h2)
    return flow


@njit_inlined
def velocity_of(model, nodes, contacts, push, dt, i):
    """Velocity of node i without the impulse of its pair [m/s]: ṽ + dt W̃ f (eq. 3.4, 3.5)."""
    w, direction, v_star = dt * push.factor * model.inverse_mass[i], push.direction, nodes.v_star
    u0, u1 = v_star[i, 0] + w * direction[i, 0], v_star[i, 1] + w * direction[i, 1]
    u2 = v_star[i, 2] + w * direction[i, 2]
    if contacts.mode[i] > FREE:
        return settled(contacts, i, u0, u1, u2)
    return u0, u1, u2


@njit_inlined
def mobile(contacts, inverse_mass, i, n0, n1, n2):
    """W̃ n of node i [1/kg] (eq. 3.4)."""
    w = inverse_mass[i]
    if contacts.mode[i] > FREE:
        d0, d1, d2 = contacts.direction[i, 0], contacts.direction[i, 1], contacts.direction[i, 2]
        n0, n1, n2 = allowed_part(contacts.mode[i], d0, d1, d2, n0, n1, n2)
    return w * n0, w * n1, w * n2


@njit_inlined
def mobility_of(pairs, contacts, inverse_mass, p):
    """W̃ n of both nodes of a pair [1/kg], and 1/(n·W̃ n of both) [kg], 0 where nothing can part them."""
    i, j = pairs.node[p, 0], pairs.node[p, 1]
    n0, n1, n2 = pairs.normal[p, 0], pairs.normal[p, 1], pairs.normal[p, 2]
    a = mobile(contacts, inverse_mass, i, n0, n1, n2)
    b = mobile(contacts, inverse_mass, j, n0, n1, n2)
    whole = n0 * (a[0] + b[0]) + n1 * (a[1] + b[1]) + n2 * (a[2] + b[2])
    free = inverse_mass[i] + inverse_mass[j]
    return a, b, (1.0 / whole if whole > NEGLIGIBLE * free else 0.0)


@njit_inlined
def apart(pairs, p, u, v):
    """n·(v − u) of the velocities of the nodes behind and in front [m/s]."""
    normal = pairs.normal
    return normal[p, 0] * (v[0] - u[0]) + normal[p, 1] * (v[1] - u[1]) + normal[p, 2] * (v[2] - u[2])


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
            u = velocity_of(model, nodes, contacts, push, dt, pairs.node[p, 0])
            v = velocity_of(model, nodes, contacts, push, dt, pairs.node[p, 1])
            touches = pairs.gap[p] + dt * apart(pairs, p, u, v) < 0.0 or (corners and is_enclosed(pairs, p))
            changes += touches != (pairs.touches[p] > 0)
            pairs.touches[p] = touches
    return changes


@njit_inlined
def is_enclosed(pairs, p):
    """Whether all mid-sides around corner p touch."""
    apart = 0
    for k in range(pairs.side_start[p], pairs.side_start[p + 1]):
        apart += pairs.touches[pairs.side[k]] == 0
    return apart == 0


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
        k = mass * (rate - apart(pairs, p, (u[i, 0], u[i, 1], u[i, 2]), (u[j, 0], u[j, 1], u[j, 2])))
        for axis in range(3):
            u[i, axis] -= k * a[axis]
            u[j, axis] += k * b[axis]


@njit_lean
def less_of_pairs(pairs, model, nodes, contacts, flow, mobility, dt):
    """G·v̂ [m³/s] and G·Ŵ·G [m⁴/kg] from G·ṽ and G·W̃·G, less the parts that touching pairs remove (eq. 9.10)."""
    if pairs is None:
        return flow, mobility
    gradient, weights = nodes.gradient, model.inverse_mass
    for p in range(pairs.gap.shape[0]):
        if pairs.touches[p] == 0:
            continue
        i, j = pairs.node[p, 0], pairs.node[p, 1]
        a, b, mass = mobility_of(pairs, contacts, weights, p)
        u, v = still(nodes, contacts, i), still(nodes, contacts, j)
        share = 0.0
        for axis in range(3):
            share += gradient[j, axis] * b[axis] - gradient[i, axis] * a[axis]
        flow += share * mass * (-pairs.gap[p] / dt - apart(pairs, p, u, v))
        mobility -= share * share * mass
    return flow, mobility


@njit_inlined
def still(nodes, contacts, i):
    """ṽ of node i [m/s] (eq. 3.4)."""
    v = nodes.v_star[i, 0], nodes.v_star[i, 1], nodes.v_star[i, 2]
    return settled(contacts, i, v[0], v[1], v[2]) if contacts.mode[i] > FREE else v


@njit_lean
def less_of_pairs_in(matrix, pairs, rows, contacts, inverse_mass):
    """S_rs −= h_r h_s/(n·W̃ n), h = J W̃ Nᵀ of every touching pair, in the lower triangle (m, m) (eq. 9.10)."""
    if pairs is None:
        return
    for p in range(pairs.gap.shape[0]):
        if pairs.touches[p] == 0:
            continue
        a, b, mass = mobility_of(pairs, contacts, inverse_mass, p)
        for one in range(2):
            i, c = pairs.node[p, one], (b if one else (-a[0], -a[1], -a[2]))
            for k in range(rows.node_start[i], rows.node_start[i + 1]):
                g = rows.node_value
                h = mass * (g[k, 0] * c[0] + g[k, 1] * c[1] + g[k, 2] * c[2])
                for other in range(2):
                    j, d = pairs.node[p, other], (b if other else (-a[0], -a[1], -a[2]))
                    for q in range(rows.node_start[j], rows.node_start[j + 1]):
                        if rows.node_row[q] <= rows.node_row[k]:
                            part = g[q, 0] * d[0] + g[q, 1] * d[1] + g[q, 2] * d[2]
                            matrix[rows.node_row[k], rows.node_row[q]] -= h * part


@njit_lean
def press_pairs(pairs, model, nodes, contacts, push, dt):
    """Adds the impulse k n [N s] of each touching pair to v* (eq. 9.10), so that later stages treat it as a force."""
    if pairs is None:
        return
    for p in range(pairs.gap.shape[0]):
        pairs.impulse[p] = 0.0
        if pairs.touches[p] == 0:
            continue
        i, j = pairs.node[p, 0], pairs.node[p, 1]
        u = velocity_of(model, nodes, contacts, push, dt, i)
        v = velocity_of(model, nodes, contacts, push, dt, j)
        _, _, mass = mobility_of(pairs, contacts, model.inverse_mass, p)
        k = mass * (-pairs.gap[p] / dt - apart(pairs, p, u, v))
        pairs.impulse[p] = k
        for axis in range(3):
            nodes.v_star[i, axis] -= k * model.inverse_mass[i] * pairs.normal[p, axis]
            nodes.v_star[j, axis] += k * model.inverse_mass[j] * pairs.normal[p, axis]
