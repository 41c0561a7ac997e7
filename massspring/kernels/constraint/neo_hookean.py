"""The two constraints of a stable neo-Hookean tetrahedron, relaxed one element after the other (eq. 13.14, 13.15)."""

import math

from massspring.kernels.contact.node_contact import moved_by
from massspring.kernels.forces.elements import cofactors, deformation, matrix_times
from massspring.kernels.jit.decorators import compiled, njit_inlined
from massspring.kernels.jit.vec3 import add_to, dot, plus, row, times


@njit_inlined
def gradient_of(elements, m, factor, e, a):
    """`factor` M ∇N_a [1/m] of a node a of element e."""
    return matrix_times(m, times(factor, row(elements.gradient[e, 0], a)))


@njit_inlined
def mobilities(contacts, inverse_mass, elements, f, c, shear, e):
    """∇C_D·W̃∇C_D, ∇C_D·W̃∇C_H and ∇C_H·W̃∇C_H [1/(kg m²)] of element e; `shear` is C_D."""
    own, mixed, volume = 0.0, 0.0, 0.0
    for a in range(4):
        i = elements.node[e, a]
        g, h = gradient_of(elements, f, 1.0 / shear, e, a), gradient_of(elements, c, 1.0, e, a)
        u, w = moved_by(contacts, inverse_mass, i, g), moved_by(contacts, inverse_mass, i, h)
        own += dot(g, u)
        mixed += dot(g, w)
        volume += dot(h, w)
    return own, mixed, volume


@compiled
def relax_elements(contacts, inverse_mass, elements, y, scale, multiplier, push):
    """One sweep: both constraints of each tetrahedron together, at y (eq. 13.15); `scale` is dt².

    `y` (n, 3) moves by dt² W̃ ∇C Δl, `multiplier` (k, 2) [J] and `push` (n, 3) [N] collect Δl and ∇C Δl. Returns
    whether an element has shrunk to a point, where no constraint has a gradient.
    """
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
        grown = dot(f, c) - elements.target_ratio[e, 0] - mu / bulk
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
            g = plus(gradient_of(elements, f, l0 / shear, e, a), gradient_of(elements, c, l1, e, a))
            add_to(push, i, g)
            add_to(y, i, times(scale, moved_by(contacts, inverse_mass, i, g)))
    return idle
