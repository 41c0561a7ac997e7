"""The volumes of all tetrahedra solved for at the end of a step: together, or one after the other (eq. 10.13,
10.14)."""

from massspring.kernels.contact.node_contact import moved_by, pushed_by_into, unpushed_into
from massspring.kernels.forces.tetrahedron_volumes import add_four, cell_slopes, four, mean_pressure
from massspring.kernels.forces.volume import volume_gradient_into
from massspring.kernels.jit.decorators import compiled
from massspring.kernels.jit.vec3 import add_to, dot, minus, put, row, times

WRONG = 1e-6
"""Relative volume error above which a volume that cannot be corrected is counted; 1 % of the error that a kept volume
may have."""


@compiled
def cell_rows_into(x, cells, out):
    """J = dV_t/dx into `cells.slope` [m²] and V_t into `out` [m³], (k,) (eq. 2.3, 10.11)."""
    for t in range(cells.tetrahedra.shape[0]):
        out[t], p, q, r = cell_slopes(x, four(cells.tetrahedra, t))
        slope = cells.slope[t]
        put(slope, 0, p)
        put(slope, 1, q)
        put(slope, 2, r)


@compiled
def cell_forces_into(cells, p, force):
    """F = Jᵀ p [N], (n, 3)."""
    force[:] = 0.0
    for t in range(cells.tetrahedra.shape[0]):
        s = cells.slope[t]
        add_four(force, four(cells.tetrahedra, t), p[t], row(s, 0), row(s, 1), row(s, 2))


@compiled
def cell_changes_into(cells, u, out):
    """(J u)_t = Σ_j dV_t/dx_j · u_j, (k,)."""
    tetrahedra, s = cells.tetrahedra, cells.slope
    for t in range(tetrahedra.shape[0]):
        total = 0.0
        for corner in range(3):
            i, a = tetrahedra[t, corner + 1], tetrahedra[t, 0]
            for axis in range(3):
                total += s[t, corner, axis] * (u[i, axis] - u[a, axis])
        out[t] = total


@compiled
def cell_diagonal_into(contacts, inverse_mass, cells, scale, compliance):
    """dt² S_tt + C V_t0 [m³/Pa], (k,), the diagonal of eq. 10.13; `scale` is dt²."""
    for t in range(cells.tetrahedra.shape[0]):
        total, a = 0.0, (0.0, 0.0, 0.0)
        for corner in range(3):
            g = row(cells.slope[t], corner)
            a = minus(a, g)
            total += dot(g, moved_by(contacts, inverse_mass, cells.tetrahedra[t, corner + 1], g))
        total += dot(a, moved_by(contacts, inverse_mass, cells.tetrahedra[t, 0], a))
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
    y, pressure, rest_volume = cells.y, cells.pressure, cells.rest_volume
    for t in range(cells.tetrahedra.shape[0]):
        nodes = a, b, c, d = four(cells.tetrahedra, t)
        volume, p, q, r = cell_slopes(y, nodes)
        o = minus(minus(times(-1.0, p), q), r)
        u, v = moved_by(contacts, inverse_mass, a, o), moved_by(contacts, inverse_mass, b, p)
        w, z = moved_by(contacts, inverse_mass, c, q), moved_by(contacts, inverse_mass, d, r)
        mobility = o[0] * u[0] + o[1] * u[1] + o[2] * u[2] + p[0] * v[0] + p[1] * v[1] + p[2] * v[2]
        mobility += q[0] * w[0] + q[1] * w[1] + q[2] * w[2] + r[0] * z[0] + r[1] * z[1] + r[2] * z[2]
        soft = compliance * rest_volume[t]
        stiff = scale * mobility + soft
        error = cells.filling[0] * rest_volume[t] - volume
        idle |= not mobility > 0.0 and abs(error) > WRONG * rest_volume[t]
        if not stiff > 0.0:
            continue
        change = (error - soft * pressure[t]) / stiff
        pressure[t] += change
        add_four(cells.push, nodes, change, p, q, r)
        move = scale * change
        add_to(y, a, times(move, u))
        add_to(y, b, times(move, v))
        add_to(y, c, times(move, w))
        add_to(y, d, times(move, z))
    return idle


@compiled
def relax_whole(model, contacts, cells, target, scale, compliance, lam):
    """The same for the one volume of the whole: returns its pressure [Pa] as well, first (eq. 10.14)."""
    y, gradient, inverse_mass = cells.y, cells.gradient, model.inverse_mass
    volume = volume_gradient_into(y, model.triangles, gradient)
    soft = compliance * cells.rest_whole
    stiff = soft
    for i in range(y.shape[0]):
        g = row(gradient, i)
        stiff += scale * dot(g, moved_by(contacts, inverse_mass, i, g))
    idle = not stiff > soft and abs(target - volume) > WRONG * target
    if not stiff > 0.0:
        return lam, idle
    change = (target - volume - soft * lam) / stiff
    for i in range(y.shape[0]):
        g = row(gradient, i)
        add_to(y, i, times(scale * change, moved_by(contacts, inverse_mass, i, g)))
        add_to(cells.push, i, times(change, g))
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
