"""The multipliers of volumes over points: S lam = rhs with S = J W̃ Jᵀ by conjugate gradients, S⁻¹ at rest as
preconditioner (docs/theory.md, eq. 8.3, 8.4, 8.13)."""

import math

from massspring.kernels.constraint.ldl_solve import respond_into
from massspring.kernels.constraint.one_volume import limited_error, surely_short
from massspring.kernels.constraint.schur import along, beyond, inner_product
from massspring.kernels.contact.face_pairs import part_faces
from massspring.kernels.contact.node_contact import after_contact, allowed
from massspring.kernels.jit.decorators import compiled, njit_inlined, njit_lean
from massspring.kernels.jit.row_sums import copy_scaled
from massspring.kernels.jit.vec3 import add_to, put, row, times
from massspring.kernels.points.elements import push_into, times_into
from massspring.kernels.points.precondition import precondition_into


@compiled
def weigh_into(model, nodes, rows, boundary):
    """Adds gravity on the mass that `mass` lacks: to v* of free nodes, and to the force on held ones."""
    gravity = boundary.gravity
    for i in range(rows.heavier.shape[0]):
        push = boundary.dt * model.inverse_mass[i] * rows.heavier[i]
        for axis in range(3):
            nodes.v_star[i, axis] += push * gravity[axis]
    for h in range(model.held_nodes.shape[0]):
        i = model.held_nodes[h]
        for axis in range(3):
            nodes.force[i, axis] += rows.heavier[i] * gravity[axis]


@njit_lean
def velocity_into(nodes, contacts, u):
    """u = ṽ [m/s], (n, 4) (eq. 3.4)."""
    for i in range(nodes.v_star.shape[0]):
        put(u, i, row(nodes.v_star, i))
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        put(u, i, after_contact(contacts, i, row(u, i)))


PRESSURE_LEFT = 0.003
"""Error of a pressure that the iteration may leave, over the mean change of pressures since rest. What volumes leave
becomes a force that grows as steps shorten, and shakes thin walls, whose pressures change little. With 0.01 the forces
of two planes at a tenth of the stable step differ by 0.12 %, with this by 0.03 %."""
LEAST_CHANGE = 1e-4
"""Smallest change of pressures that counts, over that at rest: round-off is no load."""


@njit_inlined
def change_of_pressures(rows, rest_lam):
    """Root mean square of lam_r − lam_r at rest [Pa] of the volumes that something can push."""
    total, count = 0.0, 0
    for r in range(rest_lam.shape[0]):
        if rows.diagonal[r] > 0.0:
            total += (rows.lam[r] - rest_lam[r]) ** 2
            count += 1
    return max(math.sqrt(total / max(count, 1)), LEAST_CHANGE * rows.rest_pressure)


@njit_lean
def set_right_side(frame, rows, target, tolerance, pairs=None):
    """rhs_r = (V0_r − V_r)/dt² − (J ṽ)_r/dt [m³/s²], errors capped by the bound of eq. 8.5.

    Returns whether an error was capped, and whether a volume with an error had no gradient.
    """
    model, dt = frame.model, frame.boundary.dt
    velocity_into(frame.nodes, frame.contacts, rows.velocity)
    part_faces(pairs, frame.contacts, model.inverse_mass, rows.velocity, dt, True)
    times_into(rows, rows.velocity, rows.right)
    lightest, longest, per_second = model.largest_inverse_mass, model.correction_limit, 1.0 / dt
    limited, idle = False, False
    left = PRESSURE_LEFT * change_of_pressures(rows, model.rest_lam)
    for r in range(target.shape[0]):
        error = target[r] - rows.volume[r]
        if not rows.diagonal[r] > 0.0:
            idle |= abs(error) > tolerance * target[r]
        elif not surely_short(error, rows.diagonal[r], lightest, longest):
            part = limited_error(error, rows.diagonal[r], math.sqrt(lightest * rows.diagonal[r]), longest)
            limited |= part != error
            error = part
        rows.right[r] = (error * per_second - rows.right[r]) * per_second
        rows.allowed[r] = min(tolerance * target[r] * per_second * per_second, left * rows.diagonal[r])
    return limited, idle


@njit_lean
def apply_schur(frame, rows, implicit, p, product, pairs=None):
    """S p = J (W̃ (Jᵀ p)), (m,). Held nodes do not move, no node moves into an obstacle (eq. 3.4, 8.3), and touching
    faces of a cut do not move into each other (eq. 9.10)."""
    push_into(rows, p)
    force, u, contacts, weights = rows.quick.force, rows.velocity, frame.contacts, frame.model.inverse_mass
    if implicit is None:
        for i in range(force.shape[0]):
            copy_scaled(weights[i], force, i, u, i)
    else:
        for i in range(force.shape[0]):
            put(rows.field, i, row(force, i))
        respond_into(implicit.factor, rows.field, rows.moved)
        for i in range(force.shape[0]):
            put(u, i, row(rows.moved, i))
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        put(u, i, allowed(contacts, i, row(u, i)))
    part_faces(pairs, contacts, weights, u, 1.0, False)
    times_into(rows, u, product)


@njit_lean
def add_response(model, nodes, rows, implicit, dt):
    """v* += dt A⁻¹ f for the forces in `rows.field` [N], which are also added to the force on held nodes (eq. 3.6,
    12.5)."""
    respond_into(implicit.factor, rows.field, rows.moved)
    for i in range(rows.moved.shape[0]):
        add_to(nodes.v_star, i, times(dt, row(rows.moved, i)))
    for h in range(model.held_nodes.shape[0]):
        i = model.held_nodes[h]
        add_to(nodes.force, i, row(rows.field, i))


@njit_inlined
def push_nodes(model, nodes, rows, implicit, alpha, dt):
    """v* += dt W f and the force on held nodes, with `alpha` times the forces of the last product with S (eq. 3.5)."""
    force, weights = rows.quick.force, model.inverse_mass
    if implicit is None:
        for i in range(weights.shape[0]):
            add_to(nodes.v_star, i, times(dt * alpha * weights[i], row(force, i)))
    else:
        for i in range(weights.shape[0]):
            add_to(nodes.v_star, i, times(dt * alpha, row(rows.moved, i)))
    for h in range(model.held_nodes.shape[0]):
        i = model.held_nodes[h]
        add_to(nodes.force, i, times(alpha, row(force, i)))


@njit_lean
def solve_iteratively(frame, rows, implicit, most, pairs=None):
    """lam += S⁻¹ rhs by conjugate gradients (eq. 8.4), and adds to v* what the change does.

    Ends when |rhs − S Δlam|_r ≤ allowed_r for every volume, or after `most` iterations; returns their number. A volume
    with a diagonal of 0 cannot be corrected and is left out.
    """
    residual, search, image, allowed = rows.right, rows.search, rows.image, rows.allowed
    for r in range(search.shape[0]):
        search[r] = 0.0
        if not rows.diagonal[r] > 0.0:
            residual[r], allowed[r] = 0.0, math.inf
    before, iteration = math.inf, 0
    while iteration < most and beyond(residual, allowed) > 0:
        rho = precondition_into(rows.inverse, residual, image)
        keep = rho / before
        for r in range(search.shape[0]):
            search[r] = image[r] + keep * search[r]
        apply_schur(frame, rows, implicit, search, image, pairs)
        curvature = inner_product(search, image)
        if not curvature > 0.0:
            break
        alpha = rho / curvature
        along(search, image, alpha, rows.lam, residual)
        push_nodes(frame.model, frame.nodes, rows, implicit, alpha, frame.boundary.dt)
        before = rho
        iteration += 1
    return iteration
