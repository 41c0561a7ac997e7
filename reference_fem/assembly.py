"""Residual and tangent of all elements, added into a prebuilt pattern."""

import numpy as np
from numba import njit

from reference_fem.elements import Elements
from reference_fem.material import neo_hookean_into

CONTRACT = {"contract"}
"""Fused multiply-add only: no reordering, so two runs agree bitwise."""


@njit(cache=True, fastmath=CONTRACT)
def add_elements(x, elements, parameters, positions, values, residual, tangent):
    """residual += dPi/dx, values += d²Pi/dx² (if tangent); returns the smallest J, and stops at J <= 0.

    x: u at the P2 nodes [m], interleaved, then p at the vertices [Pa], (total,). positions: (ne, 595) slots.
    Pi = sum w W(F, p). r_u = w P·grad N, r_p = w (J - 1 - p/kappa) M.
    """
    dofs, gradients, pressures, weights = elements
    ue, re = np.empty(34), np.empty(34)
    K = np.empty((34, 34))
    smallest = np.inf
    for e in range(dofs.shape[0]):
        for a in range(34):
            ue[a] = x[dofs[e, a]]
            re[a] = 0.0
        K[:] = 0.0
        J = integrate_element(ue, gradients[e], pressures, weights[e], parameters, re, K, tangent)
        smallest = min(smallest, J)
        if not J > 0.0:
            return J
        for a in range(34):
            residual[dofs[e, a]] += re[a]
        if tangent:
            slot = 0
            for a in range(34):
                for b in range(a, 34):
                    values[positions[e, slot]] += K[a, b]
                    slot += 1
    return smallest


@njit(cache=True, fastmath=CONTRACT)
def integrate_element(ue, gradients, pressures, weights, parameters, re, K, tangent):
    """Adds one element's residual re (34,) and upper tangent K (34, 34); returns its smallest J."""
    F, H, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    A, T = np.empty((9, 9)), np.empty((9, 30))
    smallest = np.inf
    for q in range(weights.shape[0]):
        G, w, p = gradients[q], weights[q], 0.0
        for a in range(4):
            p += pressures[q, a] * ue[30 + a]
        for i in range(3):
            for r in range(3):
                s = 1.0 if i == r else 0.0
                for a in range(10):
                    s += ue[10 * i + a] * G[r, a]
                F[i, r] = s
        J = neo_hookean_into(F, p, parameters, H, P, A)
        smallest = min(smallest, J)
        if not J > 0.0:
            return J
        for i in range(3):
            for a in range(10):
                re[10 * i + a] += w * (P[i, 0] * G[0, a] + P[i, 1] * G[1, a] + P[i, 2] * G[2, a])
        for a in range(4):
            re[30 + a] += w * pressures[q, a] * (J - 1.0 - p / parameters[1])
        if tangent:
            add_displacement_block(G, A, w, T, K)
            add_pressure_blocks(G, H, pressures[q], w * J, w / parameters[1], K)
    return smallest


@njit(cache=True, fastmath=CONTRACT)
def add_displacement_block(G, A, w, T, K):
    """K[ia, kb] += w G_Ja A_iJkL G_Lb, blocks k >= i, through T = A·G (9, 30)."""
    for row in range(9):
        for k in range(3):
            a0, a1, a2 = w * A[row, 3 * k], w * A[row, 3 * k + 1], w * A[row, 3 * k + 2]
            for b in range(10):
                T[row, 10 * k + b] = a0 * G[0, b] + a1 * G[1, b] + a2 * G[2, b]
    for i in range(3):
        for a in range(10):
            g0, g1, g2 = G[0, a], G[1, a], G[2, a]
            for c in range(10 * i, 30):
                K[10 * i + a, c] += g0 * T[3 * i, c] + g1 * T[3 * i + 1, c] + g2 * T[3 * i + 2, c]


@njit(cache=True, fastmath=CONTRACT)
def add_pressure_blocks(G, H, M, wJ, w_kappa, K):
    """K[ia, q] += w J H_iJ G_Ja M_q and K[q, r] -= w M_q M_r / kappa."""
    for i in range(3):
        for a in range(10):
            g = wJ * (H[i, 0] * G[0, a] + H[i, 1] * G[1, a] + H[i, 2] * G[2, a])
            for q in range(4):
                K[10 * i + a, 30 + q] += g * M[q]
    for q in range(4):
        for r in range(4):
            K[30 + q, 30 + r] -= w_kappa * M[q] * M[r]


def deformation(x, elements: Elements):
    """F (ne, nq, 3, 3) and p (ne, nq) [Pa] at the quadrature points, in plain NumPy."""
    local = x[elements.dofs]
    u = local[:, :30].reshape(-1, 3, 10)
    F = np.eye(3) + np.einsum("eia,eqra->eqir", u, elements.gradients)
    return F, local[:, 30:] @ elements.pressures.T


def energy(x, elements: Elements, material):
    """Potential Pi(x) = sum w W(F, p) [J]; written apart from the kernel, to check it."""
    F, p = deformation(x, elements)
    return float(np.sum(elements.weights * material.energy_density(F, p)))
