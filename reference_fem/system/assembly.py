"""Residual and tangent of all elements, added into a prebuilt pattern."""

import numpy as np

from reference_fem.compiled import compiled
from reference_fem.elements.shapes import Elements
from reference_fem.model.material import Material, response_into

CONTRACT = {"contract"}
"""Fused multiply-add only: no reordering, so two runs agree bitwise."""


@compiled(fastmath=CONTRACT)
def add_elements(
    x: np.ndarray,
    elements: Elements,
    parameters: np.ndarray,
    positions: np.ndarray,
    values: np.ndarray,
    residual: np.ndarray,
    tangent: bool,
):
    """residual += dPi/dx, values += d²Pi/dx² (if tangent); returns the smallest J, and stops at J <= 0.

    x: u at the nodes [m], interleaved, then p [Pa], (total,). positions: slots of the packed upper
    triangles. Pi = sum w W(F, p). r_u = w P·grad N, r_p = w (J - 1 - p/kappa) M.
    """
    dofs, gradients, pressures, weights, sizes = elements
    count = 3 * len(sizes.functions) + len(sizes.pressures)
    ue, re, K = np.empty(count), np.empty(count), np.empty((count, count))
    smallest = np.inf
    for e in range(dofs.shape[0]):
        for a in range(count):
            ue[a] = x[dofs[e, a]]
        re[:] = 0.0
        K[:] = 0.0
        J = integrate_element(
            ue, gradients[e], pressures, weights[e], sizes.functions, sizes.pressures, parameters, re, K, tangent
        )
        smallest = min(smallest, J)
        if not J > 0.0:
            return J
        for a in range(count):
            residual[dofs[e, a]] += re[a]
        if tangent:
            slot = 0
            for a in range(count):
                for b in range(a, count):
                    values[positions[e, slot]] += K[a, b]
                    slot += 1
    return smallest


@compiled(fastmath=CONTRACT, inline="always")
def deformation_into(ue: np.ndarray, G: np.ndarray, functions: tuple, F: np.ndarray):
    """F = 1 + sum u_a grad N_a (3, 3)."""
    count = len(functions)
    for i in range(3):
        for r in range(3):
            s = 1.0 if i == r else 0.0
            for a in range(count):
                s += ue[count * i + a] * G[r, a]
            F[i, r] = s


@compiled(fastmath=CONTRACT)
def integrate_element(
    ue: np.ndarray,
    gradients: np.ndarray,
    pressures: np.ndarray,
    weights: np.ndarray,
    functions: tuple,
    constraints: tuple,
    parameters: np.ndarray,
    re: np.ndarray,
    K: np.ndarray,
    tangent: bool,
):
    """Adds one element's residual re and upper tangent K; returns its smallest J."""
    F, H, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    A, T, scratch = np.empty((9, 9)), np.empty((9, 3 * len(functions))), np.empty((3, 3, 3))
    count, kappa = len(functions), parameters[2]
    smallest = np.inf
    for q in range(weights.shape[0]):
        G, w, p = gradients[q], weights[q], 0.0
        for a in range(len(constraints)):
            p += pressures[q, a] * ue[3 * count + a]
        deformation_into(ue, G, functions, F)
        J = response_into(F, p, parameters, H, P, A, scratch, tangent)
        smallest = min(smallest, J)
        if not J > 0.0:
            return J
        for i in range(3):
            for a in range(count):
                re[count * i + a] += w * (P[i, 0] * G[0, a] + P[i, 1] * G[1, a] + P[i, 2] * G[2, a])
        for a in range(len(constraints)):
            re[3 * count + a] += w * pressures[q, a] * (J - 1.0 - p / kappa)
        if tangent:
            add_displacement_block(G, A, w, functions, T, K)
            add_pressure_blocks(G, H, pressures[q], w * J, w / kappa, functions, constraints, K)
    return smallest


@compiled(fastmath=CONTRACT)
def add_displacement_block(G: np.ndarray, A: np.ndarray, w: float, functions: tuple, T: np.ndarray, K: np.ndarray):
    """K[ia, kb] += w G_Ja A_iJkL G_Lb, blocks k >= i, through T = A·G (9, 3 nu)."""
    count = len(functions)
    for row in range(9):
        for k in range(3):
            a0, a1, a2 = w * A[row, 3 * k], w * A[row, 3 * k + 1], w * A[row, 3 * k + 2]
            for b in range(count):
                T[row, count * k + b] = a0 * G[0, b] + a1 * G[1, b] + a2 * G[2, b]
    for i in range(3):
        for a in range(count):
            g0, g1, g2 = G[0, a], G[1, a], G[2, a]
            for c in range(count * i, 3 * count):
                K[count * i + a, c] += g0 * T[3 * i, c] + g1 * T[3 * i + 1, c] + g2 * T[3 * i + 2, c]


@compiled(fastmath=CONTRACT)
def add_pressure_blocks(
    G: np.ndarray,
    H: np.ndarray,
    M: np.ndarray,
    wJ: float,
    w_kappa: float,
    functions: tuple,
    constraints: tuple,
    K: np.ndarray,
):
    """K[ia, q] += w J H_iJ G_Ja M_q and K[q, r] -= w M_q M_r / kappa."""
    count = len(functions)
    for i in range(3):
        for a in range(count):
            g = wJ * (H[i, 0] * G[0, a] + H[i, 1] * G[1, a] + H[i, 2] * G[2, a])
            for q in range(len(constraints)):
                K[count * i + a, 3 * count + q] += g * M[q]
    for q in range(len(constraints)):
        for r in range(len(constraints)):
            K[3 * count + q, 3 * count + r] -= w_kappa * M[q] * M[r]


def deformation(x: np.ndarray, elements: Elements):
    """F (ne, nq, 3, 3) and p (ne, nq) [Pa] at the quadrature points, in plain NumPy."""
    local, count = x[elements.dofs], 3 * len(elements.sizes.functions)
    u = local[:, :count].reshape(len(local), 3, -1)
    F = np.eye(3) + np.einsum("eia,eqra->eqir", u, elements.gradients)
    return F, local[:, count:] @ elements.pressures.T


def energy(x: np.ndarray, elements: Elements, material: Material):
    """Potential Pi(x) = sum w W(F, p) [J]; independent of the kernel, to check it."""
    F, p = deformation(x, elements)
    return float(np.sum(elements.weights * material.energy_density(F, p)))
