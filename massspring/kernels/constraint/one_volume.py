"""The multiplier of one volume, and the limit on how far its correction moves a node."""

import math

from massspring.kernels.contact.modes import FREE
from massspring.kernels.contact.node_contact import allowed_part, taken_share
from massspring.kernels.jit.decorators import njit_exposed, njit_inlined, njit_lean

NEGLIGIBLE_MOBILITY = 1e-12
"""Ratio to the mobility without contact below which a mobility counts as round-off."""


@njit_lean
def volume_multiplier(nodes, contacts, inverse_mass, volume_error, dt):
    """lam = [(V0 − V) − dt G·ṽ] / (dt² G·W̃·G) [Pa]: one division (eq. 3.3). Returns (lam, G·W̃·G).

    ṽ, W̃: velocity and inverse mass of a touched node act only along its obstacle (eq. 3.4). `volume_error` is V0 − V.
    Limit: without a gradient no pressure can act; lam is 0 if G·W̃·G is not positive.
    """
    flow = 0.0
    mobility = 0.0
    for i in range(inverse_mass.shape[0]):
        g0, g1, g2 = nodes.gradient[i, 0], nodes.gradient[i, 1], nodes.gradient[i, 2]
        v0, v1, v2 = nodes.v_star[i, 0], nodes.v_star[i, 1], nodes.v_star[i, 2]
        flow += g0 * v0 + g1 * v1 + g2 * v2
        square = g0 * g0 + g1 * g1 + g2 * g2
        if contacts.mode[i] > FREE:
            mode = contacts.mode[i]
            d0, d1, d2 = contacts.direction[i, 0], contacts.direction[i, 1], contacts.direction[i, 2]
            p0, p1, p2 = allowed_part(mode, d0, d1, d2, g0, g1, g2)
            square = g0 * p0 + g1 * p1 + g2 * p2
            p0, p1, p2 = allowed_part(mode, d0, d1, d2, v0, v1, v2)
            flow += g0 * (p0 + contacts.v_target[i, 0] - v0)
            flow += g1 * (p1 + contacts.v_target[i, 1] - v1)
            flow += g2 * (p2 + contacts.v_target[i, 2] - v2)
        mobility += inverse_mass[i] * square
    if not mobility > 0.0:
        return 0.0, mobility
    return (volume_error - dt * flow) / (dt * dt * mobility), mobility


@njit_exposed
def multiplier_of_sums(nodes, contacts, inverse_mass, volume_error, dt, flow, mobility):
    """The same from the sums G·v* and G·W·G over all nodes, corrected at the few touched nodes (eq. 3.3, 3.4)."""
    mode, direction, v_target, gradient, v_star = (
        contacts.mode,
        contacts.direction,
        contacts.v_target,
        nodes.gradient,
        nodes.v_star,
    )
    free = mobility
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if mode[i] > FREE:
            g = gradient[i, 0], gradient[i, 1], gradient[i, 2]
            d = direction[i, 0], direction[i, 1], direction[i, 2]
            mobility -= inverse_mass[i] * taken_share(mode[i], d, g, g)
            flow -= taken_share(mode[i], d, g, (v_star[i, 0], v_star[i, 1], v_star[i, 2]))
            flow += g[0] * v_target[i, 0] + g[1] * v_target[i, 1] + g[2] * v_target[i, 2]
    if mobility <= NEGLIGIBLE_MOBILITY * free:
        return 0.0, 0.0
    return (volume_error - dt * flow) / (dt * dt * mobility), mobility


@njit_lean
def steepest(gradient, inverse_mass):
    """max_i w_i |G_i| [m²/kg]: how far the node that moves most goes per unit of pressure and dt²."""
    largest = 0.0
    for i in range(inverse_mass.shape[0]):
        square = gradient[i, 0] ** 2 + gradient[i, 1] ** 2 + gradient[i, 2] ** 2
        largest = max(largest, inverse_mass[i] * math.sqrt(square))
    return largest


@njit_inlined
def surely_short(volume_error, mobility, lightest, longest):
    """Whether correcting a volume error e surely moves no node farther than `longest` [m]: |e| √(max w / G·W̃·G) ≤
    longest.

    max_i w_i |G_i| ≤ √(max w · G·W̃·G) without contact; the exact maximum is computed only if this bound fails.
    """
    return volume_error * volume_error * lightest <= longest * longest * mobility


@njit_inlined
def limited_error(volume_error, mobility, steepest, longest):
    """V0 − V, at most `longest` · G·W̃·G / max w|G| [m³]: then no node moves farther than `longest` [m] (eq. 8.5)."""
    most = longest * mobility / steepest if steepest > 0.0 else 0.0
    return min(max(volume_error, -most), most)
