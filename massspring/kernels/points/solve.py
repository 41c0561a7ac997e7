"""The multipliers of volumes over points: S lam = rhs with S = J W̃ Jᵀ by conjugate gradients, S⁻¹ at rest as
preconditioner (docs/theory.md, eq. 8.3, 8.4, 8.13)."""

import math

from massspring.kernels.constraint.ldl_solve import respond_into
from massspring.kernels.constraint.one_volume import limited_error, surely_short
from massspring.kernels.constraint.schur import along, beyond, inner_product
from massspring.kernels.contact.face_pairs import part_faces
from massspring.kernels.contact.node_contact import after_contact, allowed
from massspring.kernels.jit.decorators import compiled, njit_inlined, njit_lean
from massspring.kernels.jit.flat import flat
from massspring.kernels.jit.vec3 import add_to, plus, put, row, times
from massspring.kernels.points.elements import push_elements, push_of, times_into
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


@njit_inlined
def respond(model, force, implicit, moved):
    """W f [m/s²] into `moved` (n, 3): node by node, or with the inverse of the matrix of implicit springs."""
    if implicit is None:
        for i in range(force.shape[0]):
            put(moved, i, times(model.inverse_mass[i], row(force, i)))
    else:
        respond_into(implicit.factor, force, moved)


@njit_lean
def pushed_velocity_into(model, nodes, contacts, rows, implicit, dt):
    """u = ṽ + dt W̃ F [m/s] into `node_vector`, (n, 4), with the force F [N] of `rows.push` (eq. 3.4, 3.5)."""
    u, moved = rows.node_vector, rows.moved
    respond(model, rows.push, implicit, moved)
    for i in range(moved.shape[0]):
        put(u, i, after_contact(contacts, i, plus(row(nodes.v_star, i), times(dt, row(moved, i)))))


@njit_lean
def set_right_side(frame, rows, implicit, target, tolerance, pairs=None):
    """rhs_r = (V0_r − V_r)/dt² − (J u)_r/dt [m³/s²], errors capped by the bound of eq. 8.5, u = ṽ + dt W̃ F.

    Returns whether an error was capped, and whether a volume with an error had no gradient.
    """
    model, dt = frame.model, frame.boundary.dt
    pushed_velocity_into(model, frame.nodes, frame.contacts, rows, implicit, dt)
    part_faces(pairs, frame.contacts, model.inverse_mass, rows.node_vector, dt, True)
    times_into(rows, rows.node_vector, rows.right)
    lightest, longest, per_second = model.largest_inverse_mass, model.correction_limit, 1.0 / dt
    limited, idle = False, False
    for r in range(target.shape[0]):
        error = target[r] - rows.volume[r]
        if not rows.diagonal[r] > 0.0:
            idle |= abs(error) > tolerance * target[r]
        elif not surely_short(error, rows.diagonal[r], lightest, longest):
            part = limited_error(error, rows.diagonal[r], math.sqrt(lightest * rows.diagonal[r]), longest)
            limited |= part != error
            error = part
        rows.right[r] = (error * per_second - rows.right[r]) * per_second
        rows.allowed[r] = tolerance * target[r] * per_second * per_second
    return limited, idle


@njit_lean
def apply_schur(frame, rows, implicit, p, product, pairs=None):
    """S p = J (W̃ (Jᵀ p)), (m,). Held nodes do not move, no node moves into an obstacle (eq. 3.4, 8.3), and touching
    faces of a cut do not move into each other (eq. 9.10)."""
    push_elements(rows, p, False)
    force, u, contacts = flat(rows.element_push, 0, rows.element_push.shape[0]), rows.node_vector, frame.contacts
    field, moved = rows.field, rows.moved
    for i in range(field.shape[0]):
        put(field, i, push_of(rows, force, p, i))
    respond(frame.model, field, implicit, moved)
    for i in range(moved.shape[0]):
        put(u, i, allowed(contacts, i, row(moved, i)))
    part_faces(pairs, contacts, frame.model.inverse_mass, u, 1.0, False)
    times_into(rows, u, product)


@njit_lean
def add_response(model, nodes, rows, implicit, dt):
    """v* += dt W f for the forces in `rows.field` [N], which are also added to the force on held nodes (eq. 3.1,
    3.6)."""
    respond(model, rows.field, implicit, rows.moved)
    for i in range(rows.moved.shape[0]):
        add_to(nodes.v_star, i, times(dt, row(rows.moved, i)))
    for h in range(model.held_nodes.shape[0]):
        i = model.held_nodes[h]
        add_to(nodes.force, i, row(rows.field, i))


@njit_lean
def solve_iteratively(frame, rows, implicit, most, pairs=None):
    """lam += S⁻¹ rhs by conjugate gradients (eq. 8.4), and adds the forces of the change to `rows.push`.

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
        for i in range(rows.push.shape[0]):
            add_to(rows.push, i, times(alpha, row(rows.field, i)))
        before = rho
        iteration += 1
    return iteration
