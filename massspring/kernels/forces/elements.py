"""Linear or quadratic elements with a volume penalty at every point: energy, forces and stiffness (docs/theory.md,
section 13)."""

from typing import NamedTuple

import numpy as np

from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import compiled, njit_inlined, njit_lean

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
    node, gradient = elements.node, elements.gradient
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for a in range(node.shape[1]):
        i = node[e, a]
        g0, g1, g2 = gradient[e, q, a, 0], gradient[e, q, a, 1], gradient[e, q, a, 2]
        f00, f01, f02 = f00 + x[i, 0] * g0, f01 + x[i, 0] * g1, f02 + x[i, 0] * g2
        f10, f11, f12 = f10 + x[i, 1] * g0, f11 + x[i, 1] * g1, f12 + x[i, 1] * g2
        f20, f21, f22 = f20 + x[i, 2] * g0, f21 + x[i, 2] * g1, f22 + x[i, 2] * g2
    return f00, f01, f02, f10, f11, f12, f20, f21, f22


@njit_inlined
def open_element_point(elements, f, e, q):
    """D_a = w cof F ∇N_a into `area` (eq. 8.10). Returns J, and Σ |D_a|² over its value at rest."""
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = f
    c00, c01, c02 = f11 * f22 - f12 * f21, f12 * f20 - f10 * f22, f10 * f21 - f11 * f20
    c10, c11, c12 = f21 * f02 - f22 * f01, f22 * f00 - f20 * f02, f20 * f01 - f21 * f00
    c20, c21, c22 = f01 * f12 - f02 * f11, f02 * f10 - f00 * f12, f00 * f11 - f01 * f10
    gradient, area, w, now, rest = elements.gradient, elements.area, elements.weight[e, q], 0.0, 0.0
    for a in range(area.shape[0]):
        g0, g1, g2 = gradient[e, q, a, 0], gradient[e, q, a, 1], gradient[e, q, a, 2]
        d0, d1, d2 = c00 * g0 + c01 * g1 + c02 * g2, c10 * g0 + c11 * g1 + c12 * g2, c20 * g0 + c21 * g1 + c22 * g2
        area[a, 0], area[a, 1], area[a, 2] = w * d0, w * d1, w * d2
        now, rest = now + d0 * d0 + d1 * d1 + d2 * d2, rest + g0 * g0 + g1 * g1 + g2 * g2
    return f00 * c00 + f01 * c01 + f02 * c02, now / rest


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
            f00, f01, f02, f10, f11, f12, f20, f21, f22 = deformation(elements, x, e, q)
            c0, c1, c2 = f11 * f22 - f12 * f21, f12 * f20 - f10 * f22, f10 * f21 - f11 * f20
            grown = f00 * c0 + f01 * c1 + f02 * c2 - 1.0
            missing = grown + 1.0 - elements.target_ratio[e, q]
            density = -mu * grown + 0.5 * local * grown * grown + 0.5 * bulk * missing * missing
            total += elements.weight[e, q] * density
    return total


@njit_lean
def element_forces_into(elements, x, force):
    """f_a = Σ_q p_q D_qa [N], (n, 3) (eq. 13.4). Returns whether the volume of a point has no gradient."""
    force[:] = 0.0
    node, area, idle = elements.node, elements.area, False
    for e in range(node.shape[0]):
        for q in range(elements.weight.shape[1]):
            ratio, steep = open_element_point(elements, deformation(elements, x, e, q), e, q)
            pressure = point_pressure(elements, ratio, e, q)
            idle |= steep < FLAT
            for a in range(node.shape[1]):
                i = node[e, a]
                force[i, 0] += pressure * area[a, 0]
                force[i, 1] += pressure * area[a, 1]
                force[i, 2] += pressure * area[a, 2]
    return idle


@njit_inlined
def add_point_stiffness(elements, f, stiff, turning, place):
    """Adds `stiff` D_a ⊗ D_b − `turning` ∂²J/∂x_a∂x_b of a point (e, q) to `block`, for a ≤ b (eq. 8.14, 13.5)."""
    e, q = place
    gradient, area, block = elements.gradient, elements.area, elements.block
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = f
    for a in range(area.shape[0]):
        a0, a1, a2 = stiff * area[a, 0], stiff * area[a, 1], stiff * area[a, 2]
        g0, g1, g2 = gradient[e, q, a, 0], gradient[e, q, a, 1], gradient[e, q, a, 2]
        for b in range(a, area.shape[0]):
            b0, b1, b2 = area[b, 0], area[b, 1], area[b, 2]
            h0, h1, h2 = gradient[e, q, b, 0], gradient[e, q, b, 1], gradient[e, q, b, 2]
            t0, t1, t2 = g1 * h2 - g2 * h1, g2 * h0 - g0 * h2, g0 * h1 - g1 * h0
            v0 = turning * (f00 * t0 + f01 * t1 + f02 * t2)
            v1 = turning * (f10 * t0 + f11 * t1 + f12 * t2)
            v2 = turning * (f20 * t0 + f21 * t1 + f22 * t2)
            block[a, b, 0, 0] += a0 * b0
            block[a, b, 0, 1] += a0 * b1 - v2
            block[a, b, 0, 2] += a0 * b2 + v1
            block[a, b, 1, 0] += a1 * b0 + v2
            block[a, b, 1, 1] += a1 * b1
            block[a, b, 1, 2] += a1 * b2 - v0
            block[a, b, 2, 0] += a2 * b0 - v1
            block[a, b, 2, 1] += a2 * b1 + v0
            block[a, b, 2, 2] += a2 * b2


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
