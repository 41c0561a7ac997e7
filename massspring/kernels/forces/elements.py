"""Linear or quadratic elements with a volume penalty at every point: energy, forces and stiffness (docs/theory.md,
section 13)."""

from typing import NamedTuple

import numpy as np

from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import compiled, njit_inlined, njit_lean
from massspring.kernels.jit.vec3 import add_to, cross, dot, plus, put, row, times

FLAT = 1e-20
"""Share of its square at rest below which ∂J/∂x counts as zero."""


@by_address
class Elements(NamedTuple):
    """k elements of a nodes with q points each. The springs without length of the body carry their shear energy."""

    node: np.ndarray
    """(k, a) int64."""
    gradient: np.ndarray
    """∇N_a at rest [1/m], (k, q, a, 3)."""
    weight: np.ndarray
    """w_q [m³], (k, q)."""
    constants: np.ndarray
    """mu, K and the bulk modulus b of the springs' own volume term [Pa], (3,)."""
    target_ratio: np.ndarray
    """J* of each point: target over rest volume in the current step [1], (k, q)."""
    area: np.ndarray
    """Scratch: D_a = w cof F ∇N_a [m²] of one point, (a, 3)."""
    block: np.ndarray
    """Scratch: the stiffness of one element [N/m], (a, a, 3, 3)."""


class Places(NamedTuple):
    """Indices of the stiffness entries of free nodes in the data of the sparse matrix."""

    entry: np.ndarray
    """Index of the first entry of each 3 × 3 block of an element, (k, a, a) int64; −1 if a node is held."""
    width: np.ndarray
    """Distance in the data between two rows of a block, for each node that owns the rows, (n,) int64."""


@njit_inlined
def deformation(elements, x, e, q):
    """F_q = Σ_a x_a ⊗ ∇N_a, row by row, nine numbers (eq. 8.8)."""
    node, gradient = elements.node, elements.gradient[e, q]
    f = g = h = (0.0, 0.0, 0.0)
    for a in range(node.shape[1]):
        p, slope = row(x, node[e, a]), row(gradient, a)
        f, g, h = plus(f, times(p[0], slope)), plus(g, times(p[1], slope)), plus(h, times(p[2], slope))
    return f + g + h


@njit_inlined
def open_element_point(elements, f, e, q):
    """D_a = w cof F ∇N_a into `area` (eq. 8.10). Returns J, and Σ |D_a|² over its value at rest."""
    c, gradient, w, now, rest = cofactors(f), elements.gradient[e, q], elements.weight[e, q], 0.0, 0.0
    for a in range(gradient.shape[0]):
        g = row(gradient, a)
        d = matrix_times(c, g)
        put(elements.area, a, times(w, d))
        now, rest = now + d[0] * d[0] + d[1] * d[1] + d[2] * d[2], rest + g[0] * g[0] + g[1] * g[1] + g[2] * g[2]
    return dot(f, c), now / rest


@njit_inlined
def point_pressure(elements, ratio, e, q):
    """p = mu − b (J − 1) − K (J − J*) [Pa] (eq. 13.4)."""
    mu, bulk, local = elements.constants
    return mu - local * (ratio - 1.0) - bulk * (ratio - elements.target_ratio[e, q])


@njit_lean
def element_energy(elements, x):
    """Σ_q w_q (−mu (J − 1) + b/2 (J − 1)² + K/2 (J − J*)²) [J] (eq. 13.1)."""
    mu, bulk, local = elements.constants
    total = 0.0
    for e in range(elements.node.shape[0]):
        for q in range(elements.weight.shape[1]):
            f = deformation(elements, x, e, q)
            grown = dot(f, cross(f[3:6], f[6:9])) - 1.0
            missing = grown + 1.0 - elements.target_ratio[e, q]
            density = -mu * grown + 0.5 * local * grown * grown + 0.5 * bulk * missing * missing
            total += elements.weight[e, q] * density
    return total


@njit_lean
def element_forces_into(elements, x, force):
    """f_a = Σ_q p_q D_qa [N], (n, 3) (eq. 13.4). Returns whether the volume of a point has no gradient."""
    force[:] = 0.0
    node, idle = elements.node, False
    for e in range(node.shape[0]):
        for q in range(elements.weight.shape[1]):
            ratio, steep = open_element_point(elements, deformation(elements, x, e, q), e, q)
            pressure = point_pressure(elements, ratio, e, q)
            idle |= steep < FLAT
            for a in range(node.shape[1]):
                add_to(force, node[e, a], times(pressure, row(elements.area, a)))
    return idle


@njit_inlined
def add_point_stiffness(elements, f, stiff, turning, place):
    """Adds `stiff` D_a ⊗ D_b − `turning` ∂²J/∂x_a∂x_b of a point (e, q) to `block`, for a ≤ b (eq. 8.14, 13.5)."""
    e, q = place
    gradient, area, block = elements.gradient[e, q], elements.area, elements.block
    for a in range(area.shape[0]):
        own, g = times(stiff, row(area, a)), row(gradient, a)
        for b in range(a, area.shape[0]):
            other = row(area, b)
            v0, v1, v2 = times(turning, matrix_times(f, cross(g, row(gradient, b))))
            part = block[a, b]
            add_to(part, 0, plus(times(own[0], other), (0.0, -v2, v1)))
            add_to(part, 1, plus(times(own[1], other), (v2, 0.0, -v0)))
            add_to(part, 2, plus(times(own[2], other), (-v1, v0, 0.0)))


@njit_inlined
def scatter(elements, places, e, factor, data):
    """Adds `factor` times the stiffness in `block` of element e, and its transpose, to the data of the matrix."""
    node, block, entry, width = elements.node, elements.block, places.entry, places.width
    for a in range(node.shape[1]):
        for b in range(node.shape[1]):
            first = entry[e, a, b]
            if first < 0:
                continue
            for i in range(3):
                row = first + i * width[node[e, a]]
                for j in range(3):
                    data[row + j] += factor * (block[a, b, i, j] if a <= b else block[b, a, j, i])


@compiled
def add_element_stiffness(elements, places, x, factor, exact, data):
    """Adds `factor` Σ_q (K + b)/w D ⊗ D − p w ∂²J/∂x² of the free nodes to `data` (eq. 13.5). If not `exact`: only the
    first term, which is positive."""
    bulk, local = elements.constants[1], elements.constants[2]
    for e in range(elements.node.shape[0]):
        elements.block[:] = 0.0
        for q in range(elements.weight.shape[1]):
            f = deformation(elements, x, e, q)
            ratio, _ = open_element_point(elements, f, e, q)
            weight = elements.weight[e, q]
            turning = weight * point_pressure(elements, ratio, e, q) if exact else 0.0
            add_point_stiffness(elements, f, (bulk + local) / weight, turning, (e, q))
        scatter(elements, places, e, factor, data)


@njit_inlined
def matrix_times(m, a):
    """M a of nine numbers, row by row, and three."""
    return (
        m[0] * a[0] + m[1] * a[1] + m[2] * a[2],
        m[3] * a[0] + m[4] * a[1] + m[5] * a[2],
        m[6] * a[0] + m[7] * a[1] + m[8] * a[2],
    )


@njit_inlined
def cofactors(f):
    """cof F, row by row, nine numbers; F·cof F = 3 det F."""
    a, b, c = f[0:3], f[3:6], f[6:9]
    return cross(b, c) + cross(c, a) + cross(a, b)
