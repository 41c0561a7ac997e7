"""Springs, and triangle springs: a wall that stretches and shears like a thin sheet of tissue (Delingette 2008)."""

import math

from massspring.kernels.jit.decorators import njit_inlined, njit_lean
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


@njit_lean
def largest_strain(x, earlier, ends, length):
    """max_e |d_e − d_e'|/L_e [1] of springs of lengths L_e (s,) [m] between two shapes; d_e = x_j − x_i."""
    square = 0.0
    for s in range(ends.shape[0]):
        i, j = ends[s, 0], ends[s, 1]
        d = minus(minus(row(x, j), row(x, i)), minus(row(earlier, j), row(earlier, i)))
        square = max(square, dot(d, d) / (length[s] * length[s]))
    return math.sqrt(square)


@njit_lean
def add_membrane_forces(x, membrane, force):
    """f_b += 2 g_a (x_c − x_b), f_c −= the same [N], (n, 3), with g_a = k_a Δ_a + c_b Δ_c + c_c Δ_b (eq. 4.6).

    Δ_a = |x_c − x_b|² − L_a² of the edge opposite node a. Zero at rest; internal: forces and moments sum to zero.
    """
    for t in range(membrane.triangles.shape[0]):
        (i, j, k), (a, b, c), (da, db, dc) = edges_of(x, membrane, t)
        ka, kb, kc = row(membrane.stiffness, t)
        ca, cb, cc = row(membrane.coupling, t)
        pull_a = times(2.0 * (ka * da + cb * dc + cc * db), a)
        pull_b = times(2.0 * (kb * db + cc * da + ca * dc), b)
        pull_c = times(2.0 * (kc * dc + ca * db + cb * da), c)
        add_to(force, i, minus(pull_c, pull_b))
        add_to(force, j, minus(pull_a, pull_c))
        add_to(force, k, minus(pull_b, pull_a))


@njit_lean
def membrane_energy(x, membrane):
    """U = Σ_t Σ_a ½ k_a Δ_a² + c_a Δ_b Δ_c [J] (eq. 4.6)."""
    energy = 0.0
    for t in range(membrane.triangles.shape[0]):
        _, _, grown = edges_of(x, membrane, t)
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            energy += (
                0.5 * membrane.stiffness[t, a] * grown[a] * grown[a] + membrane.coupling[t, a] * grown[b] * grown[c]
            )
    return energy


@njit_inlined
def edges_of(x, membrane, t):
    """Nodes i, j, k of a triangle, its edges a, b, c opposite to them, and Δ of each edge [m²]."""
    i, j, k = membrane.triangles[t, 0], membrane.triangles[t, 1], membrane.triangles[t, 2]
    p, q, r = row(x, i), row(x, j), row(x, k)
    a, b, c = minus(r, q), minus(p, r), minus(q, p)
    grown = minus((dot(a, a), dot(b, b), dot(c, c)), row(membrane.rest_square, t))
    return (i, j, k), (a, b, c), grown
