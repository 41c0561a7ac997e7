"""Spring forces and energy."""

import math

from massspring.kernels.jit.decorators import njit_lean

SHORTEST = 1e-30  # [m] a collapsed spring has no direction: it pulls with 0 instead of NaN; a float32 can hold it


@njit_lean
def spring_forces_into(x, ends, rest_length, stiffness, force):
    """f_i = Σ_e k_e (1 − L_e/|d_e|) d_e [N], (n, 3); d_e = x_j − x_i (eq. 1.1).

    Zero at rest length; internal: the forces sum to zero and carry no moment.
    """
    force[:] = 0.0
    for s in range(ends.shape[0]):
        i = ends[s, 0]
        j = ends[s, 1]
        d0 = x[j, 0] - x[i, 0]
        d1 = x[j, 1] - x[i, 1]
        d2 = x[j, 2] - x[i, 2]
        length = max(math.sqrt(d0 * d0 + d1 * d1 + d2 * d2), SHORTEST)
        c = stiffness[s] * (1.0 - rest_length[s] / length)
        force[i, 0] += c * d0
        force[i, 1] += c * d1
        force[i, 2] += c * d2
        force[j, 0] -= c * d0
        force[j, 1] -= c * d1
        force[j, 2] -= c * d2


@njit_lean
def spring_energy(x, ends, rest_length, stiffness):
    """U = Σ_e ½ k_e (|d_e| − L_e)² [J] (eq. 1.2)."""
    energy = 0.0
    for s in range(ends.shape[0]):
        i = ends[s, 0]
        j = ends[s, 1]
        d0 = x[j, 0] - x[i, 0]
        d1 = x[j, 1] - x[i, 1]
        d2 = x[j, 2] - x[i, 2]
        stretch = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2) - rest_length[s]
        energy += 0.5 * stiffness[s] * stretch * stretch
    return energy
