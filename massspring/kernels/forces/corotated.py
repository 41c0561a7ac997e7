"""Corotated linear tetrahedra: energy, forces and stiffness (docs/theory.md, section 13).

Linear elasticity in the frame that turns with each element (Müller and Gross, Interactive virtual materials, Graphics
Interface 2004), as an energy with its exact derivatives. The rotation is the proper one nearest to F, for inverted
elements too.
"""

import math

from massspring.kernels.forces.elements import deformation, scatter
from massspring.kernels.jit.decorators import compiled, njit_exposed, njit_inlined, njit_lean

MOST_STEPS = 60
"""Most steps of Newton's method for the trace. It takes about six if the rotation is well defined; at a double root
each step only halves the error."""
UNDEFINED = 1e-7
"""Share of the cubed trace below which two rotations count as equally near to F: a double root is accurate only to the
square root of round-off."""


@njit_inlined
def cofactors(f):
    """cof F, row by row, nine numbers; F·cof F = 3 det F."""
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = f
    c00, c01, c02 = f11 * f22 - f12 * f21, f12 * f20 - f10 * f22, f10 * f21 - f11 * f20
    c10, c11, c12 = f21 * f02 - f22 * f01, f22 * f00 - f20 * f02, f20 * f01 - f21 * f00
    c20, c21, c22 = f01 * f12 - f02 * f11, f02 * f10 - f00 * f12, f00 * f11 - f01 * f10
    return c00, c01, c02, c10, c11, c12, c20, c21, c22


@njit_inlined
def dot_nine(f, c):
    """F·C = Σ F_ij C_ij of nine numbers each."""
    first = f[0] * c[0] + f[1] * c[1] + f[2] * c[2]
    return first + f[3] * c[3] + f[4] * c[4] + f[5] * c[5] + f[6] * c[6] + f[7] * c[7] + f[8] * c[8]


@njit_inlined
def largest_trace(square, ratio, cofactor):
    """s = max R·F over all rotations R (eq. 13.9): the largest root of Horn's quartic, by Newton's method from above.

    `square` is |F|², `ratio` det F, `cofactor` |cof F|².
    """
    s = math.sqrt(3.0 * square)
    for _ in range(MOST_STEPS):
        slope = 4.0 * (s * (s * s - square) - 2.0 * ratio)
        if not slope > 0.0:
            break
        value = s * s * (s * s - 2.0 * square) - 8.0 * ratio * s + square * square - 4.0 * cofactor
        after = s - value / slope
        if not after < s:
            break
        s = after
    return s


@njit_exposed
def rotation(f):
    """(R, s, whether R is defined): the rotation nearest to F, row by row, and s = R·F (eq. 13.9, 13.10)."""
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = f
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = cofactors(f)
    square, cofactor = dot_nine(f, f), dot_nine(cofactors(f), cofactors(f))
    ratio = f00 * c00 + f01 * c01 + f02 * c02
    s = largest_trace(square, ratio, cofactor)
    gap = s * (s * s - square) - 2.0 * ratio
    if gap <= UNDEFINED * s * s * s:
        return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), s, False
    g00, g11, g22 = (
        f00 * f00 + f10 * f10 + f20 * f20,
        f01 * f01 + f11 * f11 + f21 * f21,
        f02 * f02 + f12 * f12 + f22 * f22,
    )
    g01, g02, g12 = (
        f00 * f01 + f10 * f11 + f20 * f21,
        f00 * f02 + f10 * f12 + f20 * f22,
        f01 * f02 + f11 * f12 + f21 * f22,
    )
    a, b = (s * s + square) / gap, 2.0 / gap
    r00 = a * f00 + b * (s * c00 - f00 * g00 - f01 * g01 - f02 * g02)
    r01 = a * f01 + b * (s * c01 - f00 * g01 - f01 * g11 - f02 * g12)
    r02 = a * f02 + b * (s * c02 - f00 * g02 - f01 * g12 - f02 * g22)
    r10 = a * f10 + b * (s * c10 - f10 * g00 - f11 * g01 - f12 * g02)
    r11 = a * f11 + b * (s * c11 - f10 * g01 - f11 * g11 - f12 * g12)
    r12 = a * f12 + b * (s * c12 - f10 * g02 - f11 * g12 - f12 * g22)
    r20 = a * f20 + b * (s * c20 - f20 * g00 - f21 * g01 - f22 * g02)
    r21 = a * f21 + b * (s * c21 - f20 * g01 - f21 * g11 - f22 * g12)
    r22 = a * f22 + b * (s * c22 - f20 * g02 - f21 * g12 - f22 * g22)
    return (r00, r01, r02, r10, r11, r12, r20, r21, r22), s, True


@njit_inlined
def lame(elements):
    """(mu, λ = K − mu) [Pa] of the constants of elements: the moduli of (13.1) at rest."""
    return elements.constants[0], elements.constants[1] - elements.constants[0]


@njit_lean
def corotated_energy(elements, x):
    """Σ_e V_e (mu/2 (|F|² − 3) − 2 mu (s − 3) + λ/2 (s − 2 − J*)²) [J] (eq. 13.11), without the springs' mu/2 |F|²."""
    mu, second = lame(elements)
    total = 0.0
    for e in range(elements.node.shape[0]):
        f = deformation(elements, x, e, 0)
        _, s, _ = rotation(f)
        square, missing = dot_nine(f, f), s - 2.0 - elements.target_ratio[e, 0]
        density = 0.5 * mu * (square - 3.0) - 2.0 * mu * (s - 3.0) + 0.5 * second * missing * missing
        total += elements.weight[e, 0] * density
    return total


@njit_lean
def corotated_forces_into(elements, x, force):
    """f_a = −V_e (mu F + (λ (s − 2 − J*) − 2 mu) R) ∇N_a [N], (n, 3) (eq. 13.12). Returns whether a rotation is
    undefined."""
    mu, second = lame(elements)
    force[:] = 0.0
    node, gradient, idle = elements.node, elements.gradient, False
    for e in range(node.shape[0]):
        f = deformation(elements, x, e, 0)
        r, s, defined = rotation(f)
        idle |= not defined
        turned, volume = second * (s - 2.0 - elements.target_ratio[e, 0]) - 2.0 * mu, elements.weight[e, 0]
        for a in range(node.shape[1]):
            i = node[e, a]
            g0, g1, g2 = volume * gradient[e, 0, a, 0], volume * gradient[e, 0, a, 1], volume * gradient[e, 0, a, 2]
            for axis in range(3):
                k = 3 * axis
                p0, p1, p2 = (
                    mu * f[k] + turned * r[k],
                    mu * f[k + 1] + turned * r[k + 1],
                    mu * f[k + 2] + turned * r[k + 2],
                )
                force[i, axis] -= p0 * g0 + p1 * g1 + p2 * g2
    return idle


@njit_inlined
def turning(f, r, s):
    """(s 1 − F Rᵀ)⁻¹, symmetric: 00, 01, 02, 11, 12, 22 (eq. 13.13)."""
    a00 = s - (f[0] * r[0] + f[1] * r[1] + f[2] * r[2])
    a11 = s - (f[3] * r[3] + f[4] * r[4] + f[5] * r[5])
    a22 = s - (f[6] * r[6] + f[7] * r[7] + f[8] * r[8])
    a01 = -(f[0] * r[3] + f[1] * r[4] + f[2] * r[5])
    a02 = -(f[0] * r[6] + f[1] * r[7] + f[2] * r[8])
    a12 = -(f[3] * r[6] + f[4] * r[7] + f[5] * r[8])
    m00, m01, m02 = a11 * a22 - a12 * a12, a02 * a12 - a01 * a22, a01 * a12 - a02 * a11
    scale = 1.0 / (a00 * m00 + a01 * m01 + a02 * m02)
    m11, m12, m22 = a00 * a22 - a02 * a02, a01 * a02 - a00 * a12, a00 * a11 - a01 * a01
    return scale * m00, scale * m01, scale * m02, scale * m11, scale * m12, scale * m22


@njit_inlined
def turn_gradients(elements, r, e):
    """R ∇N_a of an element into `area` [1/m], (4, 3)."""
    gradient, turned = elements.gradient, elements.area
    for a in range(turned.shape[0]):
        g0, g1, g2 = gradient[e, 0, a, 0], gradient[e, 0, a, 1], gradient[e, 0, a, 2]
        turned[a, 0] = r[0] * g0 + r[1] * g1 + r[2] * g2
        turned[a, 1] = r[3] * g0 + r[4] * g1 + r[5] * g2
        turned[a, 2] = r[6] * g0 + r[7] * g1 + r[8] * g2


@njit_inlined
def corotated_block(elements, volume, factor, m):
    """Writes V (mu g_a·g_b 1 + λ g_a ⊗ g_b + `factor` [g_a]ᵀ m [g_b]) to `block` for a ≤ b, [g] e = g × e (eq.
    13.13)."""
    mu, second = lame(elements)
    turned, block = elements.area, elements.block
    m00, m01, m02, m11, m12, m22 = m
    for b in range(turned.shape[0]):
        h0, h1, h2 = turned[b, 0], turned[b, 1], turned[b, 2]
        # The columns of m [g_b].
        u00, u10, u20 = m01 * h2 - m02 * h1, m11 * h2 - m12 * h1, m12 * h2 - m22 * h1
        u01, u11, u21 = m02 * h0 - m00 * h2, m12 * h0 - m01 * h2, m22 * h0 - m02 * h2
        u02, u12, u22 = m00 * h1 - m01 * h0, m01 * h1 - m11 * h0, m02 * h1 - m12 * h0
        for a in range(b + 1):
            g0, g1, g2 = turned[a, 0], turned[a, 1], turned[a, 2]
            same, c, d = mu * (g0 * h0 + g1 * h1 + g2 * h2), factor, second
            block[a, b, 0, 0] = volume * (same + d * g0 * h0 + c * (g2 * u10 - g1 * u20))
            block[a, b, 0, 1] = volume * (d * g0 * h1 + c * (g2 * u11 - g1 * u21))
            block[a, b, 0, 2] = volume * (d * g0 * h2 + c * (g2 * u12 - g1 * u22))
            block[a, b, 1, 0] = volume * (d * g1 * h0 + c * (g0 * u20 - g2 * u00))
            block[a, b, 1, 1] = volume * (same + d * g1 * h1 + c * (g0 * u21 - g2 * u01))
            block[a, b, 1, 2] = volume * (d * g1 * h2 + c * (g0 * u22 - g2 * u02))
            block[a, b, 2, 0] = volume * (d * g2 * h0 + c * (g1 * u00 - g0 * u10))
            block[a, b, 2, 1] = volume * (d * g2 * h1 + c * (g1 * u01 - g0 * u11))
            block[a, b, 2, 2] = volume * (same + d * g2 * h2 + c * (g1 * u02 - g0 * u12))


@compiled
def add_corotated_stiffness(elements, places, x, factor, exact, data):
    """Adds `factor` times minus the derivative of (13.12) for the free nodes to `data` (eq. 13.13). If not `exact`: R K
    Rᵀ of Müller and Gross, the rotated stiffness at rest, which is positive together with the springs."""
    mu, second = lame(elements)
    for e in range(elements.node.shape[0]):
        f = deformation(elements, x, e, 0)
        r, s, defined = rotation(f)
        if not defined:
            continue
        turn_gradients(elements, r, e)
        if exact:
            turned = second * (s - 2.0 - elements.target_ratio[e, 0]) - 2.0 * mu
            corotated_block(elements, elements.weight[e, 0], turned, turning(f, r, s))
        else:
            corotated_block(elements, elements.weight[e, 0], -2.0 * mu, (0.5, 0.0, 0.0, 0.5, 0.0, 0.5))
        scatter(elements, places, e, factor, data)
