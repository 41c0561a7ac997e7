"""The multiplier of one volume, and the limit on how far its correction moves a node."""

import math

from massspring.kernels.contact.node_contact import FREE, allowed, taken_share
from massspring.kernels.jit.decorators import njit_exposed, njit_inlined, njit_lean
from massspring.kernels.jit.vec3 import dot, row

NEGLIGIBLE_MOBILITY = 1e-12
"""Ratio to the mobility without contact below which a mobility counts as round-off."""


@njit_lean
def volume_multiplier(nodes, contacts, inverse_mass, volume_error, dt):
    """lam = [(V0 − V) − dt G·ṽ] / (dt² G·W̃·G) [Pa]: one division (eq. 3.3). Returns (lam, G·W̃·G).

    ṽ, W̃: velocity and inverse mass of a touched node act only along its obstacle (eq. 3.4). `volume_error` is V0 − V.
    Limit: without a gradient no pressure can act; lam is 0 if G·W̃·G is not positive.
    """
    flow, mobility = 0.0, 0.0
    for i in range(inverse_mass.shape[0]):
        g, v = row(nodes.gradient, i), row(nodes.v_star, i)
        flow += dot(g, v)
        square = dot(g, g)
        if contacts.mode[i] > FREE:
            square = dot(g, allowed(contacts, i, g))
            p, target = allowed(contacts, i, v), contacts.v_target
            for axis in range(3):
                flow += g[axis] * (p[axis] + target[i, axis] - v[axis])
        mobility += inverse_mass[i] * square
    if not mobility > 0.0:
        return 0.0, mobility
    return (volume_error - dt * flow) / (dt * dt * mobility), mobility


@njit_exposed
def multiplier_of_sums(nodes, contacts, inverse_mass, volume_error, dt, flow, mobility):
    """The same from the sums G·v* and G·W·G over all nodes, corrected at the few touched nodes (eq. 3.3, 3.4)."""
    mode, free = contacts.mode, mobility
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if mode[i] > FREE:
            g, d = row(nodes.gradient, i), row(contacts.direction, i)
            mobility -= inverse_mass[i] * taken_share(mode[i], d, g, g)
            flow -= taken_share(mode[i], d, g, row(nodes.v_star, i))
            flow += dot(g, row(contacts.v_target, i))
    if mobility <= NEGLIGIBLE_MOBILITY * free:
        return 0.0, 0.0
    return (volume_error - dt * flow) / (dt * dt * mobility), mobility


@njit_lean
def steepest(gradient, inverse_mass):
    """max_i w_i |G_i| [m²/kg]: how far the node that moves most goes per unit of pressure and dt²."""
    largest = 0.0
    for i in range(inverse_mass.shape[0]):
        g = row(gradient, i)
        largest = max(largest, inverse_mass[i] * math.sqrt(dot(g, g)))
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
