"""Spring forces and energy."""

import math

from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.vec3 import add_to, dot, minus, row, take_from, times

SHORTEST = 1e-30  # [m] a collapsed spring has no direction: it pulls with 0 instead of NaN; a float32 can hold it


@njit_lean
def spring_forces_into(x, ends, rest_length, stiffness, force):
    """f_i = Σ_e k_e (1 − L_e/|d_e|) d_e [N], (n, 3); d_e = x_j − x_i (eq. 1.1).

    Zero at rest length; internal: the forces sum to zero and carry no moment.
    """
    force[:] = 0.0
    for s in range(ends.shape[0]):
        i, j = ends[s, 0], ends[s, 1]
        d = minus(row(x, j), row(x, i))
        length = max(math.sqrt(dot(d, d)), SHORTEST)
        pull = times(stiffness[s] * (1.0 - rest_length[s] / length), d)
        add_to(force, i, pull)
        take_from(force, j, pull)


@njit_lean
def spring_energy(x, ends, rest_length, stiffness):
    """U = Σ_e ½ k_e (|d_e| − L_e)² [J] (eq. 1.2)."""
    energy = 0.0
    for s in range(ends.shape[0]):
        d = minus(row(x, ends[s, 1]), row(x, ends[s, 0]))
        stretch = math.sqrt(dot(d, d)) - rest_length[s]
        energy += 0.5 * stiffness[s] * stretch * stretch
    return energy
