"""Implicit constraint enforcement for one enclosed volume, or for several.

Hong, Jung, Choi, Welch (2005; IEEE Computer Graphics and Applications 26(5), 2006) and Jung, Hong, Choi (2005).
The constraint is linearised at the old positions and must hold at the end of the step; with contact inside:

    lam = [(V0 − V) − dt G·ṽ] / (dt² G·W̃·G)      v⁺ = ṽ + dt lam W̃ G      x⁺ = x + dt v⁺

Several volumes have sparse rows J_r = dV_r/dx in place of Gᵀ, and S lam = rhs, S = J W̃ Jᵀ, in place of the division.

Limits: V after a step is V0 + ½ Δxᵀ H Δx + V[Δx], second order in the last step only, so the error does not accumulate;
G = 0 (a body collapsed to a line) has no gradient: the step is counted as singular and lam = 0.
"""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from massspring.body.body import Body
from massspring.kernels.arrays.layout import Accuracy, BoundaryConditions, Push
from massspring.kernels.arrays.volume_rows import VolumeRows
from massspring.kernels.constraint.jacobian import (
    diagonal_into,
    padded_rows_times_into,
    pushed_velocity_into,
    rows_into,
    steepest_of_row,
    transposed_rows_times_into,
)
from massspring.kernels.constraint.one_volume import limited_error, multiplier_of_sums, steepest, surely_short
from massspring.kernels.constraint.schur import dense_into, solve_dense, solve_iteratively
from massspring.kernels.contact.active_set import pressure_reach
from massspring.kernels.contact.face_pairs import less_of_pairs, less_of_pairs_in, part_faces, press_pairs
from massspring.kernels.jit.decorators import compiled, njit_inlined, njit_lean
from massspring.kernels.jit.stage_clock import VOLUME, end_stage
from massspring.kernels.points.arrays import PointRows
from massspring.kernels.step.begin import begin_step, begin_summed_step, count_iterations, open_frame, search_contacts
from massspring.kernels.step.end import end_step
from massspring.kernels.step.touching_faces import begin_pairs, contacts_stand, search_pairs
from massspring.layout.allocate import start
from massspring.layout.block_jacobi import clusters_at_rest
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.families.points import point_volumes_frame
from massspring.methods.families.recovery import followed_by, is_back, recovery_of, simpler, why_not_recover
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment


@njit_lean
def implicit_volume_frame(frame, lam, pairs):
    """One frame of HCJ05 with contact inside the multiplier (eq. 3.1–3.8); returns the last lam [Pa].

    `pairs`: faces of a cut that may touch, or None.
    """
    model, nodes, boundary, diagnostics = frame.model, frame.nodes, frame.boundary, frame.diagnostics
    gradient, dt = nodes.gradient, boundary.dt
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        volume, flow, mobility = begin_summed_step(frame, step)
        flow += begin_pairs(frame, pairs, gradient)
        error = boundary.volume_target[step, 0] - volume
        predicted, left = lam, 0.0
        passes = search_contacts(frame, step, Push(gradient, predicted))
        passes = search_pairs(frame, Push(gradient, predicted), passes, pairs)
        for sweep in range(passes):
            through, mobile = less_of_pairs(pairs, model, frame.nodes, frame.contacts, flow, mobility, dt)
            lam, left, limited = limited_multiplier(
                model, frame.nodes, frame.contacts, error, boundary.dt, through, mobile
            )
            diagnostics.limited[0] += limited and sweep == 0
            reach = pressure_reach(lam - predicted, left, model.largest_inverse_mass, dt)
            if contacts_stand(frame, step, Push(gradient, lam), reach, sweep + 1 == passes, pairs):
                break
        if not left > 0.0:
            diagnostics.singular[0] += 1
        press_pairs(pairs, model, frame.nodes, frame.contacts, Push(gradient, lam), dt)
        lam = end_step(frame, step, Push(gradient, lam), left, None)
    return lam


@njit_inlined
def limited_multiplier(model, nodes, contacts, error, dt, flow, mobility):
    """lam [Pa] from the sums over all nodes (eq. 3.3), G·W̃·G, and whether only part of the error is corrected (eq.
    8.5)."""
    weights, longest = model.inverse_mass, model.correction_limit
    lam, left = multiplier_of_sums(nodes, contacts, weights, error, dt, flow, mobility)
    if not left > 0.0 or surely_short(error, left, model.largest_inverse_mass, longest):
        return lam, left, False
    part = limited_error(error, left, steepest(nodes.gradient, weights), longest)
    if part != error:
        lam, _ = multiplier_of_sums(nodes, contacts, weights, part, dt, flow, mobility)
    return lam, left, part != error


@compiled
def set_right_side(model, rows, nodes, contacts, target, dt, tolerance, pairs=None):
    """rhs_r = (V0_r − V_r)/dt² − (J u)_r/dt [m³/s²] with capped errors (eq. 8.3, 8.5), u = ṽ + dt W̃ Jᵀ lam.

    Returns whether an error was capped, and whether a volume with an error had no gradient.
    """
    pushed_velocity_into(nodes, contacts, model.inverse_mass, rows.push, dt, rows.node_vector)
    part_faces(pairs, contacts, model.inverse_mass, rows.node_vector, dt, True)
    padded_rows_times_into(rows, rows.node_vector, rows.right)
    diagonal_into(rows, contacts, model.inverse_mass, rows.diagonal)
    lightest, per_second = model.largest_inverse_mass, 1.0 / dt
    limited, idle = False, False
    for r in range(target.shape[0]):
        error = target[r] - rows.volume[r]
        if not rows.diagonal[r] > 0.0:
            idle |= abs(error) > tolerance * target[r]
        elif not surely_short(error, rows.diagonal[r], lightest, model.correction_limit):
            reachable = steepest_of_row(rows, model.inverse_mass, r)
            part = limited_error(error, rows.diagonal[r], reachable, model.correction_limit)
            limited |= part != error
            error = part
        rows.right[r] = (error * per_second - rows.right[r]) * per_second
        rows.allowed[r] = tolerance * target[r] * per_second * per_second
    return limited, idle


@compiled
def solve_multipliers(model, rows, contacts, diagnostics, accuracy, pairs=None):
    """lam += S⁻¹ rhs with the current contacts (eq. 8.3, 8.4); then Jᵀ lam [N] into `rows.push`."""
    if rows.matrix.shape[0] > 0:
        dense_into(rows, contacts, model.inverse_mass, rows.matrix)
        less_of_pairs_in(rows.matrix, pairs, rows, contacts, model.inverse_mass)
        solve_dense(rows.matrix, rows.right, rows.search)
        for r in range(rows.lam.shape[0]):
            rows.lam[r] += rows.search[r]
    else:
        most = accuracy.most_iterations
        count = solve_iteratively(rows, contacts, model.inverse_mass, rows.lam, rows.allowed, most, pairs)
        count_iterations(diagnostics, count)
        if count == 0:
            return
    transposed_rows_times_into(rows, rows.lam, rows.push)


@njit_lean
def implicit_volumes_frame(frame, rows, accuracy, pairs):
    """One frame of HCJ05 with several volumes (eq. 3.1–3.8, 8.2–8.5); `rows.lam` [Pa] holds the multipliers on entry
    and exit.

    `pairs`: faces of a cut that may touch, or None.
    """
    model, nodes, contacts, boundary, diagnostics = (
        frame.model,
        frame.nodes,
        frame.contacts,
        frame.boundary,
        frame.diagnostics,
    )
    push, limited, idle = Push(rows.push, 1.0), False, False
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        begin_step(frame, step, False)
        begin_pairs(frame, pairs, None)
        rows_into(nodes.x, model.inverse_mass, rows)
        transposed_rows_times_into(rows, rows.lam, rows.push)
        end_stage(diagnostics.stage_times, VOLUME)
        target, passes = boundary.volume_target[step], search_contacts(frame, step, push)
        passes = search_pairs(frame, push, passes, pairs)
        for sweep in range(passes):
            limited, idle = set_right_side(model, rows, nodes, contacts, target, boundary.dt, accuracy.tolerance, pairs)
            solve_multipliers(model, rows, contacts, diagnostics, accuracy, pairs)
            if contacts_stand(frame, step, push, math.inf, sweep + 1 == passes, pairs):
                break
        diagnostics.limited[0] += limited
        diagnostics.singular[0] += idle
        press_pairs(pairs, model, nodes, contacts, push, boundary.dt)
        end_step(frame, step, push, 0.0, rows)


@dataclass(frozen=True)
class ImplicitVolume(Method):
    """Keeps each volume with one multiplier (HCJ05): one volume by a division, more by a small solve per step."""

    tolerance: float = 1e-5
    """Volume error that an iterative solve may leave, over the volume [1]: a thirtieth of what a kept volume may have,
    and the next step corrects it. Quadratic bodies also stop by the changes of their pressures (docs/theory.md,
    section 8)."""
    most_iterations: int = 200
    recovers: bool = False
    """Whether a body with several volumes recovers from a start that is inverted, flat or arbitrary: meanwhile it has
    springs with rest length and one volume (docs/theory.md, eq. 8.15). A start from rest is not affected."""

    name: ClassVar[str] = "implicit_volume"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 3e-4
    capabilities: ClassVar[Capabilities] = Capabilities(
        "several",
        "limited",
        prestress=True,
        point_volumes=True,
        facet_contact=True,
        thin_probes=True,
        face_contact=True,
        float32=True,
    )

    def __post_init__(self) -> None:
        if self.recovers:
            limits = dict.fromkeys(
                ("thin_probes", "float32", "events", "face_contact"), No("it may settle into another shape")
            )
            object.__setattr__(self, "capabilities", replace(self.capabilities, **limits))

    def why_not(self, body: Body) -> str | None:
        reason = self.capabilities.why_not(body)
        return why_not_recover(body) if reason is None and self.recovers else reason

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], and clusters of its volumes if these are many."""
        state = start(body, attachments, v, recovery_of(body, attachments, v) if self.recovers else None)
        rows = state.rows
        if not isinstance(rows, VolumeRows) or len(rows.matrix):
            return state
        clusters = clusters_at_rest(rows, state.nodes.x, state.model.inverse_mass)
        return replace(state, rows=rows._replace(clusters=clusters))

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        if state.memory is not None:
            if not is_back(state.memory, state.nodes.x):
                simple = self.advance(*simpler(state, state.memory, boundary))
                return followed_by(state, state.memory, simple, len(boundary.position))
            state = replace(state, memory=None, lam=np.zeros_like(state.lam))
        after = begin_frame(state, boundary)
        if after.rows is None:
            lam = implicit_volume_frame(after.frame(boundary), float(after.lam[0]), after.pairs)
            return replace(after, lam=np.array([lam]))
        after.rows.lam[:] = after.lam + after.model.rest_lam
        accuracy = Accuracy(self.tolerance, self.most_iterations)
        if isinstance(after.rows, PointRows):
            point_volumes_frame(after.frame(boundary), after.rows, None, accuracy, after.pairs)
        else:
            implicit_volumes_frame(after.frame(boundary), after.rows, accuracy, after.pairs)
        return replace(after, lam=after.rows.lam - after.model.rest_lam)
