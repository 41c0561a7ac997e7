"""Triangle springs: a wall that stretches and shears like a thin sheet of tissue (Delingette 2008)."""

from massspring.kernels.jit.decorators import njit_lean


@njit_lean
def add_membrane_forces(x, membrane, force):
    """f_b += 2 g_a (x_c − x_b), f_c −= the same [N], (n, 3), with g_a = k_a Δ_a + c_b Δ_c + c_c Δ_b (eq. 4.6).

    Δ_a = |x_c − x_b|² − L_a² of the edge opposite node a. Zero at rest; internal: forces and moments sum to zero.
    """
    for t in range(membrane.triangles.shape[0]):
        i, j, k = membrane.triangles[t, 0], membrane.triangles[t, 1], membrane.triangles[t, 2]
        a0, a1, a2 = x[k, 0] - x[j, 0], x[k, 1] - x[j, 1], x[k, 2] - x[j, 2]
        b0, b1, b2 = x[i, 0] - x[k, 0], x[i, 1] - x[k, 1], x[i, 2] - x[k, 2]
        c0, c1, c2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        da = a0 * a0 + a1 * a1 + a2 * a2 - membrane.rest_square[t, 0]
        db = b0 * b0 + b1 * b1 + b2 * b2 - membrane.rest_square[t, 1]
        dc = c0 * c0 + c1 * c1 + c2 * c2 - membrane.rest_square[t, 2]
        ka, kb, kc = membrane.stiffness[t, 0], membrane.stiffness[t, 1], membrane.stiffness[t, 2]
        ca, cb, cc = membrane.coupling[t, 0], membrane.coupling[t, 1], membrane.coupling[t, 2]
        ga = 2.0 * (ka * da + cb * dc + cc * db)
        gb = 2.0 * (kb * db + cc * da + ca * dc)
        gc = 2.0 * (kc * dc + ca * db + cb * da)
        force[i, 0] += gc * c0 - gb * b0
        force[i, 1] += gc * c1 - gb * b1
        force[i, 2] += gc * c2 - gb * b2
        force[j, 0] += ga * a0 - gc * c0
        force[j, 1] += ga * a1 - gc * c1
        force[j, 2] += ga * a2 - gc * c2
        force[k, 0] += gb * b0 - ga * a0
        force[k, 1] += gb * b1 - ga * a1
        force[k, 2] += gb * b2 - ga * a2


@njit_lean
def membrane_energy(x, membrane):
    """U = Σ_t Σ_a ½ k_a Δ_a² + c_a Δ_b Δ_c [J] (eq. 4.6)."""
    energy = 0.0
    for t in range(membrane.triangles.shape[0]):
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            da, db, dc = 0.0, 0.0, 0.0
            i, j, k = membrane.triangles[t, a], membrane.triangles[t, b], membrane.triangles[t, c]
            for axis in range(3):
                da += (x[k, axis] - x[j, axis]) ** 2
                db += (x[i, axis] - x[k, axis]) ** 2
                dc += (x[j, axis] - x[i, axis]) ** 2
            da -= membrane.rest_square[t, a]
            db -= membrane.rest_square[t, b]
            dc -= membrane.rest_square[t, c]
            energy += 0.5 * membrane.stiffness[t, a] * da * da + membrane.coupling[t, a] * db * dc
    return energy
