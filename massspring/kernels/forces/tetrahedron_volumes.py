"""Forces of methods that keep the volume of every tetrahedron by an explicit pressure (docs/theory.md, section 10)."""

import math
from typing import NamedTuple

import numpy as np

from massspring.kernels.forces.springs import SHORTEST
from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import compiled, njit_exposed, njit_inlined
from massspring.kernels.jit.vec3 import add_to, cross, dot, minus, over, plus, row, take_from, times


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
def cell_slopes(x, nodes):
    """V_t [m³] and dV_t/dx of b, c, d [m²]: (1/6) (x_c − x_a) × (x_d − x_a) and its rotations (eq. 2.3, 10.11)."""
    o = row(x, nodes[0])
    b, c, d = minus(row(x, nodes[1]), o), minus(row(x, nodes[2]), o), minus(row(x, nodes[3]), o)
    p = over(cross(c, d), 6.0)
    return dot(b, p), p, over(cross(d, b), 6.0), over(cross(b, c), 6.0)


@njit_inlined
def add_four(out, nodes, f, p, q, r):
    """Adds f p, f q, f r to the last three of four nodes and minus their sum to the first, so that the net force is
    0."""
    p, q, r = times(f, p), times(f, q), times(f, r)
    take_from(out, nodes[0], plus(plus(p, q), r))
    add_to(out, nodes[1], p)
    add_to(out, nodes[2], q)
    add_to(out, nodes[3], r)


@compiled
def fill(cells, boundary, step):
    """Sets `filling`: the target of the whole volume in this step over its rest volume."""
    cells.filling[0] = boundary.volume_target[step, 0] / cells.rest_whole


@compiled
def add_volume_forces(x, cells, bulk_modulus, force):
    """f_j = Σ_t p_t dV_t/dx_j, p_t = K (V_t0 − V_t)/V_t0 [N], (n, 3) (eq. 10.11).

    Returns whether a cell has collapsed so that its volume has no gradient.
    """
    filling, idle = cells.filling[0], False
    for t in range(cells.tetrahedra.shape[0]):
        nodes = four(cells.tetrahedra, t)
        volume, p, q, r = cell_slopes(x, nodes)
        pressure = bulk_modulus * (filling - volume / cells.rest_volume[t])
        cells.pressure[t] = pressure
        if volume == 0.0:
            idle |= p == q == r == (0.0, 0.0, 0.0)
        add_four(force, nodes, pressure, p, q, r)
    return idle


@njit_inlined
def unit(r):
    """(|r|, r/|r|); a node on the barycentre has no direction."""
    length = max(math.sqrt(dot(r, r)), SHORTEST)
    return length, over(r, length)


@compiled
def add_barycentre_forces(x, cells, bulk_modulus, force):
    """f_j = −k s (r_j/|r_j| − mean), s = Σ|r_j| − Σ|r_j|_0, k = 9 K V_t0/(Σ|r_j|_0)² [N], (n, 3) (eq. 10.12).

    Without the mean, as published, an irregular cell would exert a net force on itself.
    """
    wider = np.cbrt(cells.filling[0])
    for t in range(cells.tetrahedra.shape[0]):
        nodes = four(cells.tetrahedra, t)
        o = row(x, nodes[0])
        b, c, d = minus(row(x, nodes[1]), o), minus(row(x, nodes[2]), o), minus(row(x, nodes[3]), o)
        m = times(0.25, plus(plus(b, c), d))
        la, a = unit(times(-1.0, m))
        lb, b = unit(minus(b, m))
        lc, c = unit(minus(c, m))
        ld, d = unit(minus(d, m))
        reach, volume = cells.rest_reach[t], cells.rest_volume[t]
        stretch = la + lb + lc + ld - wider * reach
        push = -9.0 * bulk_modulus * volume * stretch / (reach * reach)
        cells.pressure[t] = push * reach / (3.0 * volume)
        m = times(0.25, plus(plus(plus(a, b), c), d))
        add_four(force, nodes, push, minus(b, m), minus(c, m), minus(d, m))


@compiled
def mean_pressure(cells):
    """Σ V_t0 p_t/Σ V_t0 [Pa]."""
    total, volume = 0.0, 0.0
    for t in range(cells.rest_volume.shape[0]):
        total += cells.rest_volume[t] * cells.pressure[t]
        volume += cells.rest_volume[t]
    return total / volume


@njit_inlined
def four(tetrahedra, t):
    """The nodes of tetrahedron t."""
    return tetrahedra[t, 0], tetrahedra[t, 1], tetrahedra[t, 2], tetrahedra[t, 3]
