"""The two constraints of a stable neo-Hookean tetrahedron, relaxed one element after the other (eq. 13.14, 13.15)."""

import math

from massspring.kernels.constraint.tetrahedra import moved_by
from massspring.kernels.forces.corotated import cofactors
from massspring.kernels.forces.elements import deformation
from massspring.kernels.jit.decorators import compiled, njit_inlined


@njit_inlined
def gradient_of(elements, m, factor, e, a):
    """`factor` M ∇N_a [1/m] of a node a of element e."""
    g = elements.gradient
    g0, g1, g2 = factor * g[e, 0, a, 0], factor * g[e, 0, a, 1], factor * g[e, 0, a, 2]
    first, second = m[0] * g0 + m[1] * g1 + m[2] * g2, m[3] * g0 + m[4] * g1 + m[5] * g2
    return first, second, m[6] * g0 + m[7] * g1 + m[8] * g2


@njit_inlined
def mobilities(contacts, inverse_mass, elements, f, c, shear, e):
    """∇C_D·W̃∇C_D, ∇C_D·W̃∇C_H and ∇C_H·W̃∇C_H [1/(kg m²)] of element e; `shear` is C_D."""
    mode, direction = contacts.mode, contacts.direction
    own, mixed, volume = 0.0, 0.0, 0.0
    for a in range(4):
        i = elements.node[e, a]
        g0, g1, g2 = gradient_of(elements, f, 1.0 / shear, e, a)
        h0, h1, h2 = gradient_of(elements, c, 1.0, e, a)
        u0, u1, u2 = moved_by(inverse_mass, mode, direction, i, g0, g1, g2)
        w0, w1, w2 = moved_by(inverse_mass, mode, direction, i, h0, h1, h2)
        own += g0 * u0 + g1 * u1 + g2 * u2
        mixed += g0 * w0 + g1 * w1 + g2 * w2
        volume += h0 * w0 + h1 * w1 + h2 * w2
    return own, mixed, volume


@compiled
def relax_elements(contacts, inverse_mass, elements, y, scale, multiplier, push):
    """One sweep: both constraints of each tetrahedron together, at y (eq. 13.15); `scale` is dt².

    `y` (n, 3) moves by dt² W̃ ∇C Δl, `multiplier` (k, 2) [J] and `push` (n, 3) [N] collect Δl and ∇C Δl. Returns
    whether an element has shrunk to a point, where no constraint has a gradient.
    """
    mode, direction = contacts.mode, contacts.direction
    idle = False
    for e in range(elements.node.shape[0]):
        mu, bulk, volume = elements.constants[0], elements.constants[1], elements.weight[e, 0]
        f = deformation(elements, y, e, 0)
        c = cofactors(f)
        squares = f[0] * f[0] + f[1] * f[1] + f[2] * f[2] + f[3] * f[3] + f[4] * f[4] + f[5] * f[5]
        shear = math.sqrt(squares + f[6] * f[6] + f[7] * f[7] + f[8] * f[8])
        if not shear > 0.0:
            idle = True
            continue
        grown = f[0] * c[0] + f[1] * c[1] + f[2] * c[2] - elements.target_ratio[e, 0] - mu / bulk
        own, mixed, other = mobilities(contacts, inverse_mass, elements, f, c, shear, e)
        soft, hard = 1.0 / (mu * volume), 1.0 / (bulk * volume)
        a00, a01, a11 = scale * own + soft, scale * mixed, scale * other + hard
        r0, r1 = -shear - soft * multiplier[e, 0], -grown - hard * multiplier[e, 1]
        det = a00 * a11 - a01 * a01
        l0, l1 = (a11 * r0 - a01 * r1) / det, (a00 * r1 - a01 * r0) / det
        multiplier[e, 0] += l0
        multiplier[e, 1] += l1
        for a in range(4):
            i = elements.node[e, a]
            g0, g1, g2 = gradient_of(elements, f, l0 / shear, e, a)
            h0, h1, h2 = gradient_of(elements, c, l1, e, a)
            g0, g1, g2 = g0 + h0, g1 + h1, g2 + h2
            d0, d1, d2 = moved_by(inverse_mass, mode, direction, i, g0, g1, g2)
            push[i, 0], push[i, 1], push[i, 2] = push[i, 0] + g0, push[i, 1] + g1, push[i, 2] + g2
            y[i, 0], y[i, 1], y[i, 2] = y[i, 0] + scale * d0, y[i, 1] + scale * d1, y[i, 2] + scale * d2
    return idle
