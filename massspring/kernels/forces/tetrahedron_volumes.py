"""Forces of methods that keep the volume of every tetrahedron by an explicit pressure (docs/theory.md, section 10)."""

import math
from typing import NamedTuple

import numpy as np

from massspring.kernels.forces.springs import SHORTEST
from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import compiled, njit_exposed, njit_inlined


@by_address
class Cells(NamedTuple):
    """k tetrahedra with the state that a method stores for each, and scratch arrays."""

    tetrahedra: np.ndarray
    """(k, 4) uint32, positive at rest."""
    rest_volume: np.ndarray
    """V_t0 [m³], (k,)."""
    rest_reach: np.ndarray
    """Σ_j |r_j| at rest, r_j from the barycentre to node j [m], (k,)."""
    rest_whole: float
    """The kept volume at rest [m³], to which targets are relative."""
    filling: np.ndarray
    """Target of every cell over its rest volume [1], (1,)."""
    pressure: np.ndarray
    """p_t [Pa], (k,)."""
    push: np.ndarray
    """Σ_t p_t dV_t/dx, the force of all cells on each node [N], (n, 3)."""
    slope: np.ndarray
    """dV_t/dx of the second, third and fourth node [m²], (k, 3, 3); the first has minus their sum."""
    right: np.ndarray
    """(k,)."""
    diagonal: np.ndarray
    """(k,)."""
    search: np.ndarray
    """(k,)."""
    image: np.ndarray
    """(k,)."""
    y: np.ndarray
    """Node vectors, scratch, (n, 3)."""
    gradient: np.ndarray
    """Node vectors, scratch, (n, 3)."""


@njit_exposed
def cell_slopes(x, a, b, c, d):
    """V_t [m³] and dV_t/dx of b, c, d [m²]: (1/6) (x_c − x_a) × (x_d − x_a) and its rotations (eq. 2.3, 10.11)."""
    b0, b1, b2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    c0, c1, c2 = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
    d0, d1, d2 = x[d, 0] - x[a, 0], x[d, 1] - x[a, 1], x[d, 2] - x[a, 2]
    p0, p1, p2 = (c1 * d2 - c2 * d1) / 6.0, (c2 * d0 - c0 * d2) / 6.0, (c0 * d1 - c1 * d0) / 6.0
    q0, q1, q2 = (d1 * b2 - d2 * b1) / 6.0, (d2 * b0 - d0 * b2) / 6.0, (d0 * b1 - d1 * b0) / 6.0
    r0, r1, r2 = (b1 * c2 - b2 * c1) / 6.0, (b2 * c0 - b0 * c2) / 6.0, (b0 * c1 - b1 * c0) / 6.0
    return b0 * p0 + b1 * p1 + b2 * p2, p0, p1, p2, q0, q1, q2, r0, r1, r2


@njit_inlined
def add_four(out, nodes, f, p, q, r):
    """Adds f p, f q, f r to the last three of four nodes and minus their sum to the first, so that the net force is
    0."""
    a, b, c, d = nodes
    p0, p1, p2 = f * p[0], f * p[1], f * p[2]
    q0, q1, q2 = f * q[0], f * q[1], f * q[2]
    r0, r1, r2 = f * r[0], f * r[1], f * r[2]
    out[a, 0] -= p0 + q0 + r0
    out[a, 1] -= p1 + q1 + r1
    out[a, 2] -= p2 + q2 + r2
    out[b, 0] += p0
    out[b, 1] += p1
    out[b, 2] += p2
    out[c, 0] += q0
    out[c, 1] += q1
    out[c, 2] += q2
    out[d, 0] += r0
    out[d, 1] += r1
    out[d, 2] += r2


@compiled
def fill(cells, boundary, step):
    """Sets `filling`: the target of the whole volume in this step over its rest volume."""
    cells.filling[0] = boundary.volume_target[step, 0] / cells.rest_whole


@compiled
def add_volume_forces(x, cells, bulk_modulus, force):
    """f_j = Σ_t p_t dV_t/dx_j, p_t = K (V_t0 − V_t)/V_t0 [N], (n, 3) (eq. 10.11).

    Returns whether a cell has collapsed so that its volume has no gradient.
    """
    tetrahedra, filling, idle = cells.tetrahedra, cells.filling[0], False
    for t in range(tetrahedra.shape[0]):
        a, b, c, d = tetrahedra[t, 0], tetrahedra[t, 1], tetrahedra[t, 2], tetrahedra[t, 3]
        volume, p0, p1, p2, q0, q1, q2, r0, r1, r2 = cell_slopes(x, a, b, c, d)
        pressure = bulk_modulus * (filling - volume / cells.rest_volume[t])
        cells.pressure[t] = pressure
        if volume == 0.0:
            idle |= p0 == p1 == p2 == q0 == q1 == q2 == r0 == r1 == r2 == 0.0
        add_four(force, (a, b, c, d), pressure, (p0, p1, p2), (q0, q1, q2), (r0, r1, r2))
    return idle


@njit_inlined
def unit(r0, r1, r2):
    """(|r|, r/|r|); a node on the barycentre has no direction."""
    length = max(math.sqrt(r0 * r0 + r1 * r1 + r2 * r2), SHORTEST)
    return length, r0 / length, r1 / length, r2 / length


@compiled
def add_barycentre_forces(x, cells, bulk_modulus, force):
    """f_j = −k s (r_j/|r_j| − mean), s = Σ|r_j| − Σ|r_j|_0, k = 9 K V_t0/(Σ|r_j|_0)² [N], (n, 3) (eq. 10.12).

    Without the mean, as published, an irregular cell would exert a net force on itself.
    """
    tetrahedra, wider = cells.tetrahedra, np.cbrt(cells.filling[0])
    for t in range(tetrahedra.shape[0]):
        a, b, c, d = tetrahedra[t, 0], tetrahedra[t, 1], tetrahedra[t, 2], tetrahedra[t, 3]
        b0, b1, b2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        c0, c1, c2 = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
        d0, d1, d2 = x[d, 0] - x[a, 0], x[d, 1] - x[a, 1], x[d, 2] - x[a, 2]
        m0, m1, m2 = 0.25 * (b0 + c0 + d0), 0.25 * (b1 + c1 + d1), 0.25 * (b2 + c2 + d2)
        la, a0, a1, a2 = unit(-m0, -m1, -m2)
        lb, b0, b1, b2 = unit(b0 - m0, b1 - m1, b2 - m2)
        lc, c0, c1, c2 = unit(c0 - m0, c1 - m1, c2 - m2)
        ld, d0, d1, d2 = unit(d0 - m0, d1 - m1, d2 - m2)
        reach, volume = cells.rest_reach[t], cells.rest_volume[t]
        stretch = la + lb + lc + ld - wider * reach
        push = -9.0 * bulk_modulus * volume * stretch / (reach * reach)
        cells.pressure[t] = push * reach / (3.0 * volume)
        m0, m1, m2 = 0.25 * (a0 + b0 + c0 + d0), 0.25 * (a1 + b1 + c1 + d1), 0.25 * (a2 + b2 + c2 + d2)
        b0, b1, b2 = b0 - m0, b1 - m1, b2 - m2
        c0, c1, c2 = c0 - m0, c1 - m1, c2 - m2
        d0, d1, d2 = d0 - m0, d1 - m1, d2 - m2
        add_four(force, (a, b, c, d), push, (b0, b1, b2), (c0, c1, c2), (d0, d1, d2))


@compiled
def mean_pressure(cells):
    """Σ V_t0 p_t/Σ V_t0 [Pa]."""
    total, volume = 0.0, 0.0
    for t in range(cells.rest_volume.shape[0]):
        total += cells.rest_volume[t] * cells.pressure[t]
        volume += cells.rest_volume[t]
    return total / volume
