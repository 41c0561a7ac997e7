"""The volumes of all tetrahedra solved for at the end of a step: together, or one after the other (eq. 10.13,
10.14)."""

from massspring.kernels.contact.constrained_motion import pushed_by_into, unpushed_into
from massspring.kernels.contact.modes import FREE
from massspring.kernels.contact.node_contact import allowed_part
from massspring.kernels.forces.tetrahedron_volumes import add_four, cell_slopes, mean_pressure
from massspring.kernels.forces.volume import volume_gradient_into
from massspring.kernels.jit.decorators import compiled, njit_inlined

WRONG = 1e-6
"""Relative volume error above which a volume that cannot be corrected is counted; 1 % of the error that a kept volume
may have."""


@compiled
def cell_rows_into(x, cells, out):
    """J = dV_t/dx into `cells.slope` [m²] and V_t into `out` [m³], (k,) (eq. 2.3, 10.11)."""
    tetrahedra, s = cells.tetrahedra, cells.slope
    for t in range(tetrahedra.shape[0]):
        a, b, c, d = tetrahedra[t, 0], tetrahedra[t, 1], tetrahedra[t, 2], tetrahedra[t, 3]
        volume, p0, p1, p2, q0, q1, q2, r0, r1, r2 = cell_slopes(x, a, b, c, d)
        s[t, 0, 0], s[t, 0, 1], s[t, 0, 2] = p0, p1, p2
        s[t, 1, 0], s[t, 1, 1], s[t, 1, 2] = q0, q1, q2
        s[t, 2, 0], s[t, 2, 1], s[t, 2, 2] = r0, r1, r2
        out[t] = volume


@compiled
def cell_forces_into(cells, p, force):
    """F = Jᵀ p [N], (n, 3)."""
    force[:] = 0.0
    tetrahedra, s = cells.tetrahedra, cells.slope
    for t in range(tetrahedra.shape[0]):
        a, b, c, d = tetrahedra[t, 0], tetrahedra[t, 1], tetrahedra[t, 2], tetrahedra[t, 3]
        p0, p1, p2 = s[t, 0, 0], s[t, 0, 1], s[t, 0, 2]
        q0, q1, q2 = s[t, 1, 0], s[t, 1, 1], s[t, 1, 2]
        r0, r1, r2 = s[t, 2, 0], s[t, 2, 1], s[t, 2, 2]
        add_four(force, (a, b, c, d), p[t], (p0, p1, p2), (q0, q1, q2), (r0, r1, r2))


@compiled
def cell_changes_into(cells, u, out):
    """(J u)_t = Σ_j dV_t/dx_j · u_j, (k,)."""
    tetrahedra, s = cells.tetrahedra, cells.slope
    for t in range(tetrahedra.shape[0]):
        a = tetrahedra[t, 0]
        total = 0.0
        for corner in range(3):
            i = tetrahedra[t, corner + 1]
            total += s[t, corner, 0] * (u[i, 0] - u[a, 0])
            total += s[t, corner, 1] * (u[i, 1] - u[a, 1])
            total += s[t, corner, 2] * (u[i, 2] - u[a, 2])
        out[t] = total


@njit_inlined
def moved_by(inverse_mass, mode, direction, i, g0, g1, g2):
    """W̃ g at node i (eq. 3.4)."""
    w = inverse_mass[i]
    d0, d1, d2 = w * g0, w * g1, w * g2
    if mode[i] > FREE:
        d0, d1, d2 = allowed_part(mode[i], direction[i, 0], direction[i, 1], direction[i, 2], d0, d1, d2)
    return d0, d1, d2


@compiled
def cell_diagonal_into(contacts, inverse_mass, cells, scale, compliance):
    """dt² S_tt + C V_t0 [m³/Pa], (k,), the diagonal of eq. 10.13; `scale` is dt²."""
    s, tetrahedra = cells.slope, cells.tetrahedra
    mode, direction = contacts.mode, contacts.direction
    for t in range(tetrahedra.shape[0]):
        total = 0.0
        a0, a1, a2 = 0.0, 0.0, 0.0
        for corner in range(3):
            g0, g1, g2 = s[t, corner, 0], s[t, corner, 1], s[t, corner, 2]
            a0, a1, a2 = a0 - g0, a1 - g1, a2 - g2
            d0, d1, d2 = moved_by(inverse_mass, mode, direction, tetrahedra[t, corner + 1], g0, g1, g2)
            total += g0 * d0 + g1 * d1 + g2 * d2
        d0, d1, d2 = moved_by(inverse_mass, mode, direction, tetrahedra[t, 0], a0, a1, a2)
        total += a0 * d0 + a1 * d1 + a2 * d2
        cells.diagonal[t] = scale * total + compliance * cells.rest_volume[t]


@compiled
def apply_cells(contacts, inverse_mass, cells, p, scale, compliance, out):
    """(dt² J W̃ Jᵀ + C V0) p [m³], (k,) (eq. 10.13); `scale` is dt²."""
    cell_forces_into(cells, p, cells.gradient)
    pushed_by_into(contacts, inverse_mass, scale, cells.gradient, cells.y)
    cell_changes_into(cells, cells.y, out)
    for t in range(p.shape[0]):
        out[t] += compliance * cells.rest_volume[t] * p[t]


@compiled
def any_idle(cells, compliance, tolerance):
    """Whether a cell with a volume error has no gradient, from the diagonal and the right-hand side of the solve."""
    for t in range(cells.diagonal.shape[0]):
        rest = cells.rest_volume[t]
        if not cells.diagonal[t] > compliance * rest and abs(cells.right[t]) > tolerance * rest:
            return True
    return False


@compiled
def solve_cells(nodes, contacts, inverse_mass, cells, dt, compliance, accuracy):
    """(dt² J W̃ Jᵀ + C V0) p = V0 − V − dt J ṽ by conjugate gradients from the last p (eq. 10.13); returns the number
    of iterations.

    Ends when |residual|_t ≤ tolerance · V_t0 for every tetrahedron. J is taken at x. On entry `cells.right` holds V.
    """
    scale = dt * dt
    unpushed_into(nodes, contacts, dt, cells.y)
    for i in range(cells.y.shape[0]):
        for axis in range(3):
            cells.y[i, axis] -= nodes.x[i, axis]
    cell_changes_into(cells, cells.y, cells.image)
    residual, search, image = cells.right, cells.search, cells.image
    for t in range(residual.shape[0]):
        residual[t] = cells.filling[0] * cells.rest_volume[t] - residual[t] - image[t]
        search[t] = 0.0
    apply_cells(contacts, inverse_mass, cells, cells.pressure, scale, compliance, image)
    cell_diagonal_into(contacts, inverse_mass, cells, scale, compliance)
    worst, before = 0.0, 0.0
    for t in range(residual.shape[0]):
        residual[t] -= image[t]
        worst = max(worst, abs(residual[t]) / cells.rest_volume[t])
    iteration = 0
    while worst > accuracy.tolerance and iteration < accuracy.most_iterations:
        rho = next_search_into(cells, before, iteration)
        before = rho
        apply_cells(contacts, inverse_mass, cells, search, scale, compliance, image)
        curvature = 0.0
        for t in range(residual.shape[0]):
            curvature += search[t] * image[t]
        if not curvature > 0.0:
            break
        worst = 0.0
        for t in range(residual.shape[0]):
            cells.pressure[t] += rho / curvature * search[t]
            residual[t] -= rho / curvature * image[t]
            worst = max(worst, abs(residual[t]) / cells.rest_volume[t])
        iteration += 1
    return iteration


@compiled
def next_search_into(cells, before, iteration):
    """The next direction of conjugate gradients, preconditioned by the diagonal D; returns r·D⁻¹r, whose last value is
    `before`."""
    residual, search = cells.right, cells.search
    rho = 0.0
    for t in range(residual.shape[0]):
        if cells.diagonal[t] > 0.0:
            rho += residual[t] * residual[t] / cells.diagonal[t]
    keep = rho / before if iteration > 0 else 0.0
    for t in range(residual.shape[0]):
        if cells.diagonal[t] > 0.0:
            search[t] = residual[t] / cells.diagonal[t] + keep * search[t]
    return rho


@compiled
def relax_cells(contacts, inverse_mass, cells, scale, compliance):
    """One sweep of XPBD: Δp = (V0 − V − C V0 p)/(dt² ∇V·W̃∇V + C V0), cell after cell, at y (eq. 10.14).

    `cells.y` moves by dt² W̃ ∇V Δp and `cells.push` [N] collects ∇V Δp; `scale` is dt².
    Returns whether a volume with an error had no gradient.
    """
    idle = False
    y, tetrahedra, pressure, rest_volume = cells.y, cells.tetrahedra, cells.pressure, cells.rest_volume
    mode, direction, force = contacts.mode, contacts.direction, cells.push
    for t in range(tetrahedra.shape[0]):
        a, b, c, d = tetrahedra[t, 0], tetrahedra[t, 1], tetrahedra[t, 2], tetrahedra[t, 3]
        volume, p0, p1, p2, q0, q1, q2, r0, r1, r2 = cell_slopes(y, a, b, c, d)
        o0, o1, o2 = -p0 - q0 - r0, -p1 - q1 - r1, -p2 - q2 - r2
        a0, a1, a2 = moved_by(inverse_mass, mode, direction, a, o0, o1, o2)
        b0, b1, b2 = moved_by(inverse_mass, mode, direction, b, p0, p1, p2)
        c0, c1, c2 = moved_by(inverse_mass, mode, direction, c, q0, q1, q2)
        d0, d1, d2 = moved_by(inverse_mass, mode, direction, d, r0, r1, r2)
        mobility = o0 * a0 + o1 * a1 + o2 * a2 + p0 * b0 + p1 * b1 + p2 * b2
        mobility += q0 * c0 + q1 * c1 + q2 * c2 + r0 * d0 + r1 * d1 + r2 * d2
        soft = compliance * rest_volume[t]
        stiff = scale * mobility + soft
        error = cells.filling[0] * rest_volume[t] - volume
        idle |= not mobility > 0.0 and abs(error) > WRONG * rest_volume[t]
        if not stiff > 0.0:
            continue
        change = (error - soft * pressure[t]) / stiff
        pressure[t] += change
        add_four(force, (a, b, c, d), change, (p0, p1, p2), (q0, q1, q2), (r0, r1, r2))
        move = scale * change
        y[a, 0], y[a, 1], y[a, 2] = y[a, 0] + move * a0, y[a, 1] + move * a1, y[a, 2] + move * a2
        y[b, 0], y[b, 1], y[b, 2] = y[b, 0] + move * b0, y[b, 1] + move * b1, y[b, 2] + move * b2
        y[c, 0], y[c, 1], y[c, 2] = y[c, 0] + move * c0, y[c, 1] + move * c1, y[c, 2] + move * c2
        y[d, 0], y[d, 1], y[d, 2] = y[d, 0] + move * d0, y[d, 1] + move * d1, y[d, 2] + move * d2
    return idle


@compiled
def relax_whole(model, contacts, cells, target, scale, compliance, lam):
    """The same for the one volume of the whole: returns its pressure [Pa] as well, first (eq. 10.14)."""
    y, gradient, force, inverse_mass = cells.y, cells.gradient, cells.push, model.inverse_mass
    mode, direction = contacts.mode, contacts.direction
    volume = volume_gradient_into(y, model.triangles, gradient)
    soft = compliance * cells.rest_whole
    stiff = soft
    for i in range(y.shape[0]):
        g0, g1, g2 = gradient[i, 0], gradient[i, 1], gradient[i, 2]
        d0, d1, d2 = moved_by(inverse_mass, mode, direction, i, g0, g1, g2)
        stiff += scale * (g0 * d0 + g1 * d1 + g2 * d2)
    idle = not stiff > soft and abs(target - volume) > WRONG * target
    if not stiff > 0.0:
        return lam, idle
    change = (target - volume - soft * lam) / stiff
    move = scale * change
    for i in range(y.shape[0]):
        g0, g1, g2 = gradient[i, 0], gradient[i, 1], gradient[i, 2]
        d0, d1, d2 = moved_by(inverse_mass, mode, direction, i, g0, g1, g2)
        y[i, 0], y[i, 1], y[i, 2] = y[i, 0] + move * d0, y[i, 1] + move * d1, y[i, 2] + move * d2
        force[i, 0], force[i, 1] = force[i, 0] + change * g0, force[i, 1] + change * g1
        force[i, 2] += change * g2
    return lam + change, idle


@compiled
def relax_sum(model, contacts, cells, target, scale, compliance):
    """Changes the pressures of all cells by one amount that corrects the sum of their volumes (eq. 10.15).

    Returns whether the sum had an error but no gradient."""
    mean = mean_pressure(cells)
    lam, idle = relax_whole(model, contacts, cells, target, scale, compliance, mean)
    for t in range(cells.pressure.shape[0]):
        cells.pressure[t] += lam - mean
    return idle
