"""Corotated linear tetrahedra: energy, forces and stiffness (docs/theory.md, section 13).

Linear elasticity in the frame that turns with each element (Müller and Gross, Interactive virtual materials, Graphics
Interface 2004), as an energy with its exact derivatives. The rotation is the proper one nearest to F, for inverted
elements too.
"""

import math

from massspring.kernels.forces.elements import cofactors, deformation, matrix_times, scatter
from massspring.kernels.jit.decorators import compiled, njit_exposed, njit_inlined, njit_lean
from massspring.kernels.jit.vec3 import cross, dot, minus, plus, put, row, take_from, times

MOST_STEPS = 60
"""Most steps of Newton's method for the trace. It takes about six if the rotation is well defined; at a double root
each step only halves the error."""
UNDEFINED = 1e-7
"""Share of the cubed trace below which two rotations count as equally near to F: a double root is accurate only to the
square root of round-off."""


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
    c = cofactors(f)
    square, cofactor, ratio = dot_nine(f, f), dot_nine(c, c), dot(f, c)
    s = largest_trace(square, ratio, cofactor)
    gap = s * (s * s - square) - 2.0 * ratio
    if gap <= UNDEFINED * s * s * s:
        return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), s, False
    x, y, z = (f[0], f[3], f[6]), (f[1], f[4], f[7]), (f[2], f[5], f[8])
    xy, xz, yz = dot(x, y), dot(x, z), dot(y, z)
    g = (dot(x, x), xy, xz), (xy, dot(y, y), yz), (xz, yz, dot(z, z))
    a, b = (s * s + square) / gap, 2.0 / gap
    first, second = turned_row(f[0:3], c[0:3], g, a, b, s), turned_row(f[3:6], c[3:6], g, a, b, s)
    return first + second + turned_row(f[6:9], c[6:9], g, a, b, s), s, True


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
    node, idle = elements.node, False
    for e in range(node.shape[0]):
        f = deformation(elements, x, e, 0)
        r, s, defined = rotation(f)
        idle |= not defined
        turned, volume = second * (s - 2.0 - elements.target_ratio[e, 0]) - 2.0 * mu, elements.weight[e, 0]
        stress = (
            plus(times(mu, f[0:3]), times(turned, r[0:3]))
            + plus(times(mu, f[3:6]), times(turned, r[3:6]))
            + plus(times(mu, f[6:9]), times(turned, r[6:9]))
        )
        for a in range(node.shape[1]):
            take_from(force, node[e, a], matrix_times(stress, times(volume, row(elements.gradient[e, 0], a))))
    return idle


@njit_inlined
def turning(f, r, s):
    """(s 1 − F Rᵀ)⁻¹, symmetric: 00, 01, 02, 11, 12, 22 (eq. 13.13)."""
    a00, a11, a22 = s - dot(f[0:3], r[0:3]), s - dot(f[3:6], r[3:6]), s - dot(f[6:9], r[6:9])
    a01, a02, a12 = -dot(f[0:3], r[3:6]), -dot(f[0:3], r[6:9]), -dot(f[3:6], r[6:9])
    m00, m01, m02 = a11 * a22 - a12 * a12, a02 * a12 - a01 * a22, a01 * a12 - a02 * a11
    scale = 1.0 / (a00 * m00 + a01 * m01 + a02 * m02)
    m11, m12, m22 = a00 * a22 - a02 * a02, a01 * a02 - a00 * a12, a00 * a11 - a01 * a01
    return scale * m00, scale * m01, scale * m02, scale * m11, scale * m12, scale * m22


@njit_inlined
def turn_gradients(elements, r, e):
    """R ∇N_a of an element into `area` [1/m], (4, 3)."""
    for a in range(elements.area.shape[0]):
        put(elements.area, a, matrix_times(r, row(elements.gradient[e, 0], a)))


@njit_inlined
def corotated_block(elements, volume, factor, m):
    """Writes V (mu g_a·g_b 1 + λ g_a ⊗ g_b + `factor` [g_a]ᵀ m [g_b]) to `block` for a ≤ b, [g] e = g × e (eq.
    13.13)."""
    mu, second = lame(elements)
    turned, none = elements.area, 0.0
    m00, m01, m02, m11, m12, m22 = m
    for b in range(turned.shape[0]):
        h = row(turned, b)
        # The rows of m [h].
        u, v, w = cross((m00, m01, m02), h), cross((m01, m11, m12), h), cross((m02, m12, m22), h)
        for a in range(b + 1):
            g, part = row(turned, a), elements.block[a, b]
            same = mu * dot(g, h)
            first, middle = (
                plus((same, none, none), times(second * g[0], h)),
                plus((none, same, none), times(second * g[1], h)),
            )
            last = plus((none, none, same), times(second * g[2], h))
            put(part, 0, times(volume, plus(first, times(factor, minus(times(g[2], v), times(g[1], w))))))
            put(part, 1, times(volume, plus(middle, times(factor, minus(times(g[0], w), times(g[2], u))))))
            put(part, 2, times(volume, plus(last, times(factor, minus(times(g[1], u), times(g[0], v))))))


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


@njit_inlined
def turned_row(f, c, g, a, b, s):
    """A row of R = a F + b (s cof F − F FᵀF) from that of F, that of cof F and FᵀF (eq. 13.10)."""
    rest = minus(minus(minus(times(s, c), times(f[0], g[0])), times(f[1], g[1])), times(f[2], g[2]))
    return plus(times(a, f), times(b, rest))
