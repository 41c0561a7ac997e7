"""The frame loop for bodies whose volumes are summed over points of quadratic elements (HCJ05 with many volumes)."""

import math
from typing import NamedTuple

import numpy as np

from massspring.kernels.arrays.layout import Push
from massspring.kernels.constraint.ldl_solve import Triangular, respond_into
from massspring.kernels.contact.face_pairs import press_pairs
from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.stage_clock import SEARCH, SPRINGS, VOLUME, end_stage
from massspring.kernels.points.elements import ease_into, forces_into
from massspring.kernels.points.facet_forces import book_points, correct_forces
from massspring.kernels.points.facets import place_further_points, push_again
from massspring.kernels.points.solve import (
    add_response,
    set_right_side,
    solve_iteratively,
    weigh_into,
)
from massspring.kernels.step.begin import (
    add_to_prediction,
    begin_step,
    count_iterations,
    look_back,
    open_frame,
    prescribe_velocity_into,
    search_contacts,
)
from massspring.kernels.step.end import end_step
from massspring.kernels.step.touching_faces import begin_pairs, contacts_stand, search_pairs


@by_address
class SpringFactor(NamedTuple):
    """Springs without length, implicit in time: A = (1 + c dt) M + dt² K, factored once (eq. 12.5)."""

    factor: Triangular
    start: np.ndarray
    """First entry of each free node in `column` and `value`, (n + 1,) uint32."""
    column: np.ndarray
    """Held neighbours, (e,) uint32."""
    value: np.ndarray
    """dt² K_ih [kg], (e,)."""


@njit_inlined
def predict_elastic(model, nodes, rows, boundary):
    """v* of eq. 3.1 from the force of all points and springs in `exact.force`, and gravity with the mass that `mass`
    lacks; the same forces on held nodes."""
    force, dt, gravity = rows.exact.force, boundary.dt, boundary.gravity
    keep = 1.0 - boundary.damping * dt
    for i in range(nodes.v.shape[0]):
        w = dt * model.inverse_mass[i]
        weight = dt + w * rows.heavier[i]
        for axis in range(3):
            nodes.v_star[i, axis] = keep * nodes.v[i, axis] + w * force[i, axis] + weight * gravity[axis]
    for h in range(model.held_nodes.shape[0]):
        i = model.held_nodes[h]
        for axis in range(3):
            nodes.force[i, axis] = force[i, axis] + rows.heavier[i] * gravity[axis]


@njit_inlined
def begin_points(frame, step, rows):
    """`begin_step` with the forces of all points under the pressures `rows.lam`."""
    model, nodes, boundary, diagnostics = frame.model, frame.nodes, frame.boundary, frame.diagnostics
    if rows.elastic:
        look_back(diagnostics, boundary, step)
        forces_into(rows, nodes.x, frame.work.padded_positions, rows.lam)
        predict_elastic(model, nodes, rows, boundary)
        held = boundary.held_displacement[step]
        prescribe_velocity_into(
            nodes.x, model.held_nodes, model.held_group, model.held_rest, held, boundary.dt, nodes.v_star
        )
    else:
        begin_step(frame, step, False)
        weigh_into(model, nodes, rows, boundary)
        forces_into(rows, nodes.x, frame.work.padded_positions, rows.lam)
        add_to_prediction(model, nodes, rows.exact.force, boundary.dt)
    end_stage(diagnostics.stage_times, VOLUME)


@njit_inlined
def take_springs_implicitly(frame, rows, implicit):
    """v* = A⁻¹ (M (v*₀ + c dt v) − dt² K_h v_h) from the prediction v*₀ of an explicit step (eq. 12.5)."""
    model, nodes, dt, field = frame.model, frame.nodes, frame.boundary.dt, rows.field
    keep = frame.boundary.damping * dt
    for i in range(field.shape[0]):
        for axis in range(3):
            field[i, axis] = model.mass[i] * (nodes.v_star[i, axis] + keep * nodes.v[i, axis])
        for k in range(implicit.start[i], implicit.start[i + 1]):
            for axis in range(3):
                field[i, axis] -= implicit.value[k] * nodes.v_star[implicit.column[k], axis]
    respond_of_free(model, nodes, implicit, rows)
    end_stage(frame.diagnostics.stage_times, SPRINGS)


@njit_inlined
def respond_of_free(model, nodes, implicit, rows):
    """Writes A⁻¹ `rows.field` to v* of the free nodes."""
    respond_into(implicit.factor, rows.field, rows.moved)
    for i in range(rows.moved.shape[0]):
        if model.inverse_mass[i] > 0.0:
            nodes.v_star[i, 0], nodes.v_star[i, 1] = rows.moved[i, 0], rows.moved[i, 1]
            nodes.v_star[i, 2] = rows.moved[i, 2]


AGREEMENTS = 1
"""How often contact inside facets and volumes follow each other once more in a step. With none the forces of either
answer those of the other a step late, which is a negative damping."""


@njit_inlined
def any_touches(boundary, inside):
    """Whether an obstacle touches points inside facets, or nodes."""
    for o in range(boundary.inside.shape[0]):  # noqa: SIM110 — numba compiles no generators
        if boundary.inside[o] == inside:
            return True
    return False


@njit_inlined
def meet_points(frame, step, push, rows, implicit):
    """Contact at nodes with the push of the last step (eq. 3.7), and inside facets with the forces of the last step
    (eq. 9.3–9.5). Returns the most passes of the active set, and how many facets are near an obstacle."""
    boundary, inside = frame.boundary, any_touches(frame.boundary, True)
    if inside:
        place_further_points(frame.nodes, rows.facets, boundary, step, frame.model.inverse_mass)
        if implicit is not None:
            rows.field[:] = 0.0
        push_again(frame, rows, step, implicit)
        if implicit is not None:
            add_response(frame.model, frame.nodes, rows, implicit, boundary.dt)
    passes = search_contacts(frame, step, push) if any_touches(boundary, False) else 1
    return passes, meet_facets(frame, step, rows, implicit) if inside else 0


@njit_inlined
def meet_facets(frame, step, rows, implicit):
    """Contact inside facets with the pressures as they are. Returns how many facets are near an obstacle."""
    boundary, model, nodes = frame.boundary, frame.model, frame.nodes
    if implicit is not None:
        rows.field[:] = 0.0
    near = correct_forces(frame, rows, step, implicit)
    if implicit is not None:
        add_response(model, nodes, rows, implicit, boundary.dt)
    end_stage(frame.diagnostics.stage_times, SEARCH)
    return near


@njit_inlined
def leave_points(frame, step, rows, near):
    """Books contact inside facets with the velocities at the end of the step."""
    if near > 0:
        book_points(frame, rows, step, near)
        end_stage(frame.diagnostics.stage_times, SEARCH)


@njit_inlined
def keep_volumes(frame, step, rows, implicit, accuracy, push, passes, pairs):
    """The multipliers with contact inside facets as it is (eq. 8.3, 8.4), in up to `passes` of the active set of nodes.
    Returns whether an error was capped, and whether a volume with an error had no gradient."""
    target, limited, idle = frame.boundary.volume_target[step], False, False
    for sweep in range(passes):
        limited, idle = set_right_side(frame, rows, target, accuracy.tolerance, pairs)
        count = solve_iteratively(frame, rows, implicit, accuracy.most_iterations, pairs)
        count_iterations(frame.diagnostics, count)
        if contacts_stand(frame, step, push, math.inf, sweep + 1 == passes, pairs):
            break
    return limited, idle


@njit_lean
def point_volumes_frame(frame, rows, implicit, accuracy, pairs):
    """One frame with volumes over points (eq. 3.1–3.8, 8.3–8.5, 8.8–8.13); `rows.lam` [Pa] holds the multipliers on
    entry and exit.

    `implicit`: the factor of implicit springs, or None. `pairs`: faces of a cut that may touch, or None.
    """
    model, nodes, boundary, diagnostics = frame.model, frame.nodes, frame.boundary, frame.diagnostics
    push = Push(nodes.gradient, 0.0)  # v* has the forces of all pressures
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        ease_into(rows)
        begin_points(frame, step, rows)
        begin_pairs(frame, pairs, None)
        if implicit is not None:
            take_springs_implicitly(frame, rows, implicit)
        passes, near = meet_points(frame, step, push, rows, implicit)
        passes = search_pairs(frame, push, passes, pairs)
        limited, idle = keep_volumes(frame, step, rows, implicit, accuracy, push, passes, pairs)
        for _ in range(AGREEMENTS if near > 0 else 0):
            near = meet_facets(frame, step, rows, implicit)
            limited, idle = keep_volumes(frame, step, rows, implicit, accuracy, push, passes, pairs)
        leave_points(frame, step, rows, near)
        diagnostics.limited[0] += limited
        diagnostics.singular[0] += idle
        press_pairs(pairs, model, nodes, frame.contacts, push, boundary.dt)
        end_step(frame, step, push, 0.0, None)
