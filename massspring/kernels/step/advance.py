"""Time stepping: symplectic Euler, prescribed nodes, and the multiplier of one volume."""

import math

from massspring.kernels.contact.friction import shares
from massspring.kernels.contact.node_contact import allowed_part, taken_share
from massspring.kernels.jit.decorators import inlined, lean
from massspring.kernels.jit.flat import flat
from massspring.kernels.jit.thread_team import MOVE, call, join

NEGLIGIBLE = 1e-12
"""A mobility this much smaller than what it was taken from is round-off."""
NEAR = 4096
"""Nodes of which a step's end fits the second cache."""


@lean
def prescribe_velocity_into(x, held_nodes, held_group, held_rest, displacement, dt, v_star):
    """v*_i = (X_i + d_g − x_i)/dt [m/s] for every held node: it ends the step where its attachment is (eq. 7)."""
    for h in range(held_nodes.shape[0]):
        i = held_nodes[h]
        g = held_group[h]
        for axis in range(3):
            v_star[i, axis] = (held_rest[h, axis] + displacement[g, axis] - x[i, axis]) / dt


@lean
def volume_multiplier(motion, inverse_mass, volume_error, dt):
    """lam = [(V0 − V) − dt G·ṽ] / (dt² G·W̃·G) [Pa]: one division (eq. 8). Returns (lam, G·W̃·G).

    ṽ, W̃: velocity and inverse mass of a touched node act only along its obstacle (eq. 9). `volume_error` is V0 − V.
    Limit: with no gradient there is nothing to push on; the caller skips when G·W̃·G is not positive.
    """
    flow = 0.0
    mobility = 0.0
    for i in range(inverse_mass.shape[0]):
        g0, g1, g2 = motion.gradient[i, 0], motion.gradient[i, 1], motion.gradient[i, 2]
        v0, v1, v2 = motion.v_star[i, 0], motion.v_star[i, 1], motion.v_star[i, 2]
        flow += g0 * v0 + g1 * v1 + g2 * v2
        square = g0 * g0 + g1 * g1 + g2 * g2
        if motion.locked[i] > 0:
            locked = motion.locked[i]
            d0, d1, d2 = motion.direction[i, 0], motion.direction[i, 1], motion.direction[i, 2]
            p0, p1, p2 = allowed_part(locked, d0, d1, d2, g0, g1, g2)
            square = g0 * p0 + g1 * p1 + g2 * p2
            p0, p1, p2 = allowed_part(locked, d0, d1, d2, v0, v1, v2)
            flow += g0 * (p0 + motion.goal[i, 0] - v0)
            flow += g1 * (p1 + motion.goal[i, 1] - v1)
            flow += g2 * (p2 + motion.goal[i, 2] - v2)
        mobility += inverse_mass[i] * square
    if not mobility > 0.0:
        return 0.0, mobility
    return (volume_error - dt * flow) / (dt * dt * mobility), mobility


@inlined
def multiplier_of_sums(motion, inverse_mass, volume_error, dt, flow, mobility):
    """The same from G·v* and G·W·G of all nodes, less what obstacles take of the few they touch (eq. 8, 9)."""
    locked, direction, goal, gradient, v_star = (
        motion.locked,
        motion.direction,
        motion.goal,
        motion.gradient,
        motion.v_star,
    )
    free = mobility
    for k in range(motion.touching_count[0]):
        i = motion.touching[k]
        if locked[i] > 0:
            g0, g1, g2 = gradient[i, 0], gradient[i, 1], gradient[i, 2]
            v0, v1, v2 = v_star[i, 0], v_star[i, 1], v_star[i, 2]
            d0, d1, d2 = direction[i, 0], direction[i, 1], direction[i, 2]
            mobility -= inverse_mass[i] * taken_share(locked[i], d0, d1, d2, g0, g1, g2, g0, g1, g2)
            flow -= taken_share(locked[i], d0, d1, d2, g0, g1, g2, v0, v1, v2)
            flow += g0 * goal[i, 0] + g1 * goal[i, 1] + g2 * goal[i, 2]
    if mobility <= NEGLIGIBLE * free:
        return 0.0, 0.0
    return (volume_error - dt * flow) / (dt * dt * mobility), mobility


@inlined
def prescribe(network, motion, displacement, dt):
    """v* of held nodes (eq. 7); returns what that changes of G·v* [m³/s]."""
    nodes, groups, rest = network.held_nodes, network.held_group, network.held_rest
    x, v_star, gradient = motion.x, motion.v_star, motion.gradient
    flow, per_step = 0.0, 1.0 / dt
    for h in range(nodes.shape[0]):
        i, g = nodes[h], groups[h]
        for axis in range(3):
            held = per_step * (rest[h, axis] + displacement[g, axis] - x[i, axis])
            flow += gradient[i, axis] * (held - v_star[i, axis])
            v_star[i, axis] = held
    return flow


@lean
def steepest(gradient, inverse_mass):
    """max_i w_i |G_i| [m²/kg]: how far the node that moves most goes per unit of pressure and dt²."""
    largest = 0.0
    for i in range(inverse_mass.shape[0]):
        square = gradient[i, 0] ** 2 + gradient[i, 1] ** 2 + gradient[i, 2] ** 2
        largest = max(largest, inverse_mass[i] * math.sqrt(square))
    return largest


@inlined
def surely_short(volume_error, mobility, lightest, longest):
    """Whether no node moves farther than `longest` [m] to make up for a wrong volume: |e| √(max w / G·W̃·G) ≤ longest.

    max_i w_i |G_i| ≤ √(max w · G·W̃·G) without contact; the true reach is looked for only when this bound fails.
    """
    return volume_error * volume_error * lightest <= longest * longest * mobility


@inlined
def capped_error(volume_error, mobility, steepest, longest):
    """V0 − V, at most `longest` · G·W̃·G / max w|G| [m³]: then no node moves farther than `longest` [m] (eq. 35)."""
    most = longest * mobility / steepest if steepest > 0.0 else 0.0
    return min(max(volume_error, -most), most)


@lean
def book(contact_impulse, o, other, k0, k1, k2):
    """Moves an impulse [N s] from the account of one obstacle to another's: a wedge pushes with both."""
    contact_impulse[o, 0] -= k0
    contact_impulse[o, 1] -= k1
    contact_impulse[o, 2] -= k2
    contact_impulse[other, 0] += k0
    contact_impulse[other, 1] += k1
    contact_impulse[other, 2] += k2


@inlined
def settled(motion, i, u0, u1, u2):
    """What obstacles make of the velocity of a node they touch [m/s], P u + goal (eq. 10)."""
    d0, d1, d2 = motion.direction[i, 0], motion.direction[i, 1], motion.direction[i, 2]
    p0, p1, p2 = allowed_part(motion.locked[i], d0, d1, d2, u0, u1, u2)
    return p0 + motion.goal[i, 0], p1 + motion.goal[i, 1], p2 + motion.goal[i, 2]


@inlined
def book_contacts(motion, mass, inverse_mass, lam, dt, contact_impulse):
    """Adds the impulse of each obstacle, m (v⁺ − u) [N s] (eq. 10); u is what a node would do without them."""
    v_star, gradient, locked = motion.v_star, motion.gradient, motion.locked
    real = motion.x.dtype.type
    impulse = real(dt * lam)
    for k in range(motion.touching_count[0]):
        i = motion.touching[k]
        if locked[i] == 0:
            continue
        push = impulse * real(inverse_mass[i])
        u0, u1 = v_star[i, 0] + push * gradient[i, 0], v_star[i, 1] + push * gradient[i, 1]
        u2 = v_star[i, 2] + push * gradient[i, 2]
        w0, w1, w2 = settled(motion, i, u0, u1, u2)
        o, m = motion.touched[i] - 1, mass[i]
        k0, k1, k2 = m * (w0 - u0), m * (w1 - u1), m * (w2 - u2)
        contact_impulse[o, 0] += k0
        contact_impulse[o, 1] += k1
        contact_impulse[o, 2] += k2
        if locked[i] == 2:
            m0, m1, m2 = motion.second_normal[i, 0], motion.second_normal[i, 1], motion.second_normal[i, 2]
            n0, n1, n2 = motion.normal[i, 0], motion.normal[i, 1], motion.normal[i, 2]
            _, beta = shares((k0, k1, k2), (n0, n1, n2), (m0, m1, m2))
            book(contact_impulse, o, motion.second[i] - 1, beta * m0, beta * m1, beta * m2)


@inlined
def advance_nodes(motion, inverse_mass, lam, dt, first, last):
    """v⁺ = ṽ + dt lam W̃ G, x⁺ = x + dt v⁺ (eq. 10) of some nodes; `places` holds the x of the step's start."""
    flat_x, flat_v = flat(motion.x, first, last), flat(motion.v, first, last)
    flat_v_star, flat_gradient = flat(motion.v_star, first, last), flat(motion.gradient, first, last)
    weights, locked, real = flat(inverse_mass, first, last), motion.locked, motion.x.dtype.type
    step, impulse = real(dt), real(dt * lam)
    for i in range(weights.shape[0]):
        push = impulse * real(weights[i])
        for axis in range(3):
            u = flat_v_star[3 * i + axis] + push * flat_gradient[3 * i + axis]
            flat_v[3 * i + axis] = u
            flat_x[3 * i + axis] += step * u
    x, v, places = motion.x, motion.v, motion.places
    for k in range(motion.touching_count[0]):
        i = motion.touching[k]
        if first <= i < last and locked[i] > 0:
            v[i, 0], v[i, 1], v[i, 2] = settled(motion, i, v[i, 0], v[i, 1], v[i, 2])
            for axis in range(3):
                x[i, axis] = places[i, axis] + step * v[i, axis]


@lean
def advance(motion, mass, inverse_mass, lam, dt, contact_impulse):
    """The end of a step of all nodes (eq. 10); adds the impulse of each obstacle to `contact_impulse`."""
    book_contacts(motion, mass, inverse_mass, lam, dt, contact_impulse)
    advance_nodes(motion, inverse_mass, lam, dt, 0, motion.x.shape[0])


@inlined
def advance_to_places(motion, mass, inverse_mass, lam, dt, contact_impulse):
    """The same, by as many threads as there are; `places` holds the new positions too."""
    book_contacts(motion, mass, inverse_mass, lam, dt, contact_impulse)
    move_all(motion, inverse_mass, lam, dt, motion.team)


@inlined
def move_all(motion, inverse_mass, lam, dt, team):
    """`advance_nodes` and `places_into` of all nodes, by as many threads as there are."""
    if team is None:
        move(motion, inverse_mass, lam, dt, 0, motion.x.shape[0])
    else:
        call(team, MOVE, 0, lam)
        move(motion, inverse_mass, lam, dt, team.nodes[0], team.nodes[1])
        join(team)


@inlined
def move(motion, inverse_mass, lam, dt, first, last):
    """`advance_nodes` and `places_into` of some nodes; `NEAR` at a time, so that new positions are still at hand."""
    for begin in range(first, last, NEAR):
        end = min(begin + NEAR, last)
        advance_nodes(motion, inverse_mass, lam, dt, begin, end)
        places_into(motion, begin, end)


@inlined
def places_into(motion, first, last):
    """The positions of some nodes in fours, as one move of memory fetches them, (n, 4)."""
    x, places = flat(motion.x, first, last), flat(motion.places, first, last)
    zero = motion.x.dtype.type(0)
    for i in range(last - first):
        places[4 * i], places[4 * i + 1] = x[3 * i], x[3 * i + 1]
        places[4 * i + 2], places[4 * i + 3] = x[3 * i + 2], zero


@inlined
def add_held_impulse(network, motion, lam, dt, gravity, held_impulse):
    """I_g = −dt Σ_i∈g (f_i + lam G_i + m_i g) [N s]: what an attachment gives to a body in slow motion (eq. 11)."""
    nodes, groups, mass = network.held_nodes, network.held_group, network.mass
    force, gradient = motion.force, motion.gradient
    h, count = 0, nodes.shape[0]
    while h < count:
        g = groups[h]
        k0, k1, k2, carried = 0.0, 0.0, 0.0, 0.0
        while h < count and groups[h] == g:
            i = nodes[h]
            k0 += force[i, 0] + lam * gradient[i, 0]
            k1 += force[i, 1] + lam * gradient[i, 1]
            k2 += force[i, 2] + lam * gradient[i, 2]
            carried += mass[i]
            h += 1
        held_impulse[g, 0] -= dt * (k0 + carried * gravity[0])
        held_impulse[g, 1] -= dt * (k1 + carried * gravity[1])
        held_impulse[g, 2] -= dt * (k2 + carried * gravity[2])
