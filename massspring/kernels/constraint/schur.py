"""The multipliers of m volumes: S lam = rhs with S = J W̃ Jᵀ, dense for few, iterative for many (eq. 8.3, 8.4)."""

import math

from massspring.kernels.constraint.block_jacobi import precondition_into, scale_into
from massspring.kernels.constraint.jacobian import NEGLIGIBLE_DIAGONAL, mobilised_into, padded_rows_times_into
from massspring.kernels.contact.face_pairs import part_faces
from massspring.kernels.contact.node_contact import allowed
from massspring.kernels.jit.decorators import compiled, njit_inlined, njit_lean, njit_reassociated
from massspring.kernels.jit.vec3 import dot, row, times


@compiled
def dense_into(rows, contacts, inverse_mass, matrix):
    """S_rs = Σ_j J_rj · W̃_j J_sj [m⁴/kg], its lower triangle, (m, m) (eq. 8.3)."""
    matrix[:] = 0.0
    for j in range(inverse_mass.shape[0]):
        w = inverse_mass[j]
        if w == 0.0:
            continue
        for k in range(rows.node_start[j], rows.node_start[j + 1]):
            r = rows.node_row[k]
            g = times(w, allowed(contacts, j, row(rows.value, rows.node_entry[k])))
            # The volumes around a node come in ascending order.
            for q in range(rows.node_start[j], k + 1):
                matrix[r, rows.node_row[q]] += dot(g, row(rows.value, rows.node_entry[q]))


@compiled
def solve_dense(matrix, right, change):
    """S Δlam = rhs by Cholesky, L over S in place (eq. 8.3)."""
    factor_dense(matrix)
    substitute(matrix, right, change)


@compiled
def factor_dense(matrix):
    """S = L Lᵀ, L over the lower triangle of S (eq. 8.3).

    A volume that is held by its nodes, or depends on those before it, has a pivot of round-off: its column is 0.
    """
    m = matrix.shape[0]
    for k in range(m):
        diagonal = matrix[k, k]
        pivot = diagonal
        for q in range(k):
            pivot -= matrix[k, q] * matrix[k, q]
        if pivot > NEGLIGIBLE_DIAGONAL * diagonal:
            root = math.sqrt(pivot)
            matrix[k, k] = root
            for i in range(k + 1, m):
                total = matrix[i, k]
                for q in range(k):
                    total -= matrix[i, q] * matrix[k, q]
                matrix[i, k] = total / root
        else:
            matrix[k, k] = 0.0
            for i in range(k + 1, m):
                matrix[i, k] = 0.0


@compiled
def substitute(factor, right, change):
    """L Lᵀ Δlam = rhs; Δlam_r = 0 where a pivot was round-off (eq. 8.3)."""
    m = right.shape[0]
    for k in range(m):
        total = right[k]
        for q in range(k):
            total -= factor[k, q] * change[q]
        change[k] = total / factor[k, k] if factor[k, k] > 0.0 else 0.0
    for k in range(m - 1, -1, -1):
        total = change[k]
        for i in range(k + 1, m):
            total -= factor[i, k] * change[i]
        change[k] = total / factor[k, k] if factor[k, k] > 0.0 else 0.0


@njit_lean
def apply_schur(rows, contacts, inverse_mass, p, product, pairs=None):
    """S p = J (W̃ (Jᵀ p)), (m,) (eq. 8.3), Ŵ in place of W̃ where faces of a cut touch (eq. 9.10)."""
    mobilised_into(rows, contacts, inverse_mass, p, rows.node_vector)
    part_faces(pairs, contacts, inverse_mass, rows.node_vector, 1.0, False)
    padded_rows_times_into(rows, rows.node_vector, product)


@njit_reassociated
def inner_product(a, b):
    """a · b."""
    total = 0.0
    for r in range(a.shape[0]):
        total += a[r] * b[r]
    return total


@njit_reassociated
def beyond(residual, allowed):
    """Number of volumes whose residual exceeds `allowed`; NaN does not count."""
    count = 0
    for r in range(residual.shape[0]):
        count += abs(residual[r]) > allowed[r]
    return count


@njit_inlined
def along(search, image, alpha, lam, residual):
    """One step of the iteration: lam += alpha search, residual −= alpha S search."""
    for r in range(search.shape[0]):
        lam[r] += alpha * search[r]
        residual[r] -= alpha * image[r]


@njit_lean
def solve_iteratively(rows, contacts, inverse_mass, lam, allowed, most, pairs=None):
    """lam += S⁻¹ rhs by conjugate gradients with clusters of S at rest as preconditioner (eq. 8.4, 8.7).

    Ends when |rhs − S Δlam|_r ≤ allowed_r for every volume, or after `most` iterations; returns their number. A volume
    with a diagonal of 0 cannot be corrected and is left out.
    """
    residual, search, image = rows.right, rows.search, rows.image
    for r in range(search.shape[0]):
        search[r] = 0.0
        if not rows.diagonal[r] > 0.0:
            residual[r], allowed[r] = 0.0, math.inf
    scale_into(rows.clusters, rows.diagonal)
    before = math.inf
    iteration = 0
    while iteration < most and beyond(residual, allowed) > 0:
        rho = precondition_into(rows.clusters, residual, image)
        keep = rho / before
        for r in range(search.shape[0]):
            search[r] = image[r] + keep * search[r]
        apply_schur(rows, contacts, inverse_mass, search, image, pairs)
        curvature = inner_product(search, image)
        if not curvature > 0.0:
            break
        along(search, image, rho / curvature, lam, residual)
        before = rho
        iteration += 1
    return iteration
