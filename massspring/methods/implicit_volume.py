"""Implicit constraint enforcement for one enclosed volume, or for several.

Hong, Jung, Choi, Welch (2005; IEEE Computer Graphics and Applications 26(5), 2006) and Jung, Hong, Choi (2005).
The constraint is linearised at the old positions and must hold at the end of the step; with contact inside:

    lam = [(V0 − V) − dt G·ṽ] / (dt² G·W̃·G)      v⁺ = ṽ + dt lam W̃ G      x⁺ = x + dt v⁺

Several volumes have sparse rows J_r = dV_r/dx in place of Gᵀ, and S lam = rhs, S = J W̃ Jᵀ, in place of the division.

Limits: V after a step is V0 + ½ Δxᵀ H Δx + V[Δx], second order in the last step only, so the error does not accumulate;
G = 0 (a body collapsed to a line) leaves nothing to push on, the step is counted and lam = 0.
"""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from massspring.body.body import Body
from massspring.kernels.arrays.layout import Accuracy, Drive, Push
from massspring.kernels.constraint.jacobian import (
    diagonal_into,
    padded_rows_times_into,
    pushed_velocity_into,
    rows_into,
    steepest_of_row,
    transposed_rows_times_into,
)
from massspring.kernels.constraint.one_volume import capped_error, multiplier_of_sums, steepest, surely_short
from massspring.kernels.constraint.schur import dense_into, solve_dense, solve_iteratively
from massspring.kernels.contact.active_set import CONTACT_PASSES, find_contacts, pressure_reach, revise_contacts
from massspring.kernels.fused.padded import places_into
from massspring.kernels.fused.sweep import gather_and_predict, predict_from_places
from massspring.kernels.jit.decorators import compiled, lean
from massspring.kernels.jit.stage_clock import (
    HELD,
    INTEGRATION,
    MULTIPLIER,
    OUTSIDE,
    PROBES,
    REVISION,
    SEARCH,
    SPRINGS,
    VOLUME,
    mark,
)
from massspring.kernels.probe.stage import meet_probes
from massspring.kernels.step.advance import advance, advance_to_places
from massspring.kernels.step.attachments import add_held_impulse, prescribe, prescribe_velocity_into
from massspring.layout.allocate import start
from massspring.layout.block_jacobi import clusters_at_rest
from massspring.layout.state import State
from massspring.methods.method import Method, Remedy, crewed_frame
from massspring.world.obstacles import Attachment


@lean
def implicit_volume_frame(network, motion, drive, tally, lam, probing):
    """One frame of HCJ05 with contact inside the multiplier (eq. 6–13); returns the last lam [Pa]."""
    dt = drive.dt
    lightest = network.largest_inverse_mass
    mark(tally.ticks, OUTSIDE)
    places_into(motion, 0, motion.x.shape[0])
    for step in range(drive.position.shape[0]):
        volume, flow, mobility = predict_from_places(network, motion, drive, True)
        mark(tally.ticks, SPRINGS)
        flow += prescribe(network, motion, drive.held_displacement[step], dt)
        mark(tally.ticks, HELD)
        error = drive.volume_target[step, 0] - volume
        predicted = lam
        passes = 1
        if drive.radius.shape[0] > 0:
            find_contacts(network, motion, drive, step, Push(motion.gradient, predicted))
            mark(tally.ticks, SEARCH)
            passes = CONTACT_PASSES
        for sweep in range(passes):
            lam, left = multiplier_of_sums(motion, network.inverse_mass, error, dt, flow, mobility)
            if left > 0.0 and not surely_short(error, left, lightest, network.longest_correction):
                reachable = steepest(motion.gradient, network.inverse_mass)
                part = capped_error(error, left, reachable, network.longest_correction)
                if part != error:
                    lam, _ = multiplier_of_sums(motion, network.inverse_mass, part, dt, flow, mobility)
                    tally.capped[0] += sweep == 0
            mark(tally.ticks, MULTIPLIER)
            if sweep + 1 == passes:
                break
            reach = pressure_reach(lam - predicted, left, lightest, dt)
            changes = revise_contacts(network, motion, drive, step, Push(motion.gradient, lam), reach)
            mark(tally.ticks, REVISION)
            if changes == 0:
                break
        if not left > 0.0:
            tally.skipped[0] += 1
        if probing is not None:
            lam = meet_probes(network, motion, drive, step, probing, Push(motion.gradient, lam), left, None)
            mark(tally.ticks, PROBES)
        push = Push(motion.gradient, lam)
        add_held_impulse(network, motion, push, dt, drive.gravity, tally.held_impulse)
        mark(tally.ticks, HELD)
        advance_to_places(motion, network.mass, network.inverse_mass, push, dt, tally.contact_impulse)
        mark(tally.ticks, INTEGRATION)
    return lam


@compiled
def set_right_side(network, rows, motion, target, dt, tolerance):
    """rhs_r = (V0_r − V_r)/dt² − (J u)_r/dt [m³/s²] with capped errors (eq. 33, 35), u = ṽ + dt W̃ Jᵀ lam.

    Returns whether a volume was capped, and whether a wrong one had nothing to push on.
    """
    pushed_velocity_into(motion, network.inverse_mass, rows.push, dt, rows.node_vector)
    padded_rows_times_into(rows, rows.node_vector, rows.right)
    diagonal_into(rows, motion, network.inverse_mass, rows.diagonal)
    lightest, per_second = network.largest_inverse_mass, 1.0 / dt
    capped, idle = False, False
    for r in range(target.shape[0]):
        error = target[r] - rows.volume[r]
        if not rows.diagonal[r] > 0.0:
            idle |= abs(error) > tolerance * target[r]
        elif not surely_short(error, rows.diagonal[r], lightest, network.longest_correction):
            reachable = steepest_of_row(rows, network.inverse_mass, r)
            part = capped_error(error, rows.diagonal[r], reachable, network.longest_correction)
            capped |= part != error
            error = part
        rows.right[r] = (error * per_second - rows.right[r]) * per_second
        rows.allowed[r] = tolerance * target[r] * per_second * per_second
    return capped, idle


@compiled
def solve_multipliers(network, rows, motion, tally, accuracy):
    """lam += S⁻¹ rhs for the contacts of the moment (eq. 33, 34); then Jᵀ lam [N] into `rows.push`."""
    if rows.matrix.shape[0] > 0:
        dense_into(rows, motion, network.inverse_mass, rows.matrix)
        solve_dense(rows.matrix, rows.right, rows.search)
        for r in range(rows.lam.shape[0]):
            rows.lam[r] += rows.search[r]
    else:
        count = solve_iteratively(rows, motion, network.inverse_mass, rows.lam, rows.allowed, accuracy.most_iterations)
        tally.iterations[0] += count
        tally.iterations[1] = max(tally.iterations[1], count)
        if count == 0:
            return
    transposed_rows_times_into(rows, rows.lam, rows.push)


@compiled
def implicit_volumes_frame(network, rows, motion, drive, tally, accuracy, probing):
    """One frame of HCJ05 with several volumes (eq. 6–13, 32–35); `rows.lam` [Pa] comes in and goes out."""
    dt, push = drive.dt, Push(rows.push, 1.0)
    mark(tally.ticks, OUTSIDE)
    for step in range(drive.position.shape[0]):
        gather_and_predict(network, motion, drive, False)
        mark(tally.ticks, SPRINGS)
        held = drive.held_displacement[step]
        prescribe_velocity_into(
            motion.x, network.held_nodes, network.held_group, network.held_rest, held, dt, motion.v_star
        )
        mark(tally.ticks, HELD)
        rows_into(motion.x, network.inverse_mass, rows)
        transposed_rows_times_into(rows, rows.lam, rows.push)
        mark(tally.ticks, VOLUME)
        passes = 1
        if drive.radius.shape[0] > 0:
            find_contacts(network, motion, drive, step, push)
            mark(tally.ticks, SEARCH)
            passes = CONTACT_PASSES
        for sweep in range(passes):
            capped, idle = set_right_side(network, rows, motion, drive.volume_target[step], dt, accuracy.tolerance)
            solve_multipliers(network, rows, motion, tally, accuracy)
            mark(tally.ticks, MULTIPLIER)
            if sweep + 1 == passes:
                break
            changes = revise_contacts(network, motion, drive, step, push, math.inf)
            mark(tally.ticks, REVISION)
            if changes == 0:
                break
        tally.capped[0] += capped
        tally.skipped[0] += idle
        if probing is not None:
            meet_probes(network, motion, drive, step, probing, push, 0.0, rows)
            mark(tally.ticks, PROBES)
        add_held_impulse(network, motion, push, dt, drive.gravity, tally.held_impulse)
        mark(tally.ticks, HELD)
        advance(motion, network.mass, network.inverse_mass, push, dt, tally.contact_impulse)
        mark(tally.ticks, INTEGRATION)


@dataclass(frozen=True)
class ImplicitVolume(Method):
    """Keeps each volume with one multiplier (HCJ05): one volume by a division, more by a small solve per step."""

    tolerance: float = 1e-6
    """Volume error that an iterative solve may leave, over the volume [1]: 1 % of what a kept volume may be off."""
    most_iterations: int = 200

    name: ClassVar[str] = "implicit_volume"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 3e-4
    remedy: ClassVar[Remedy | None] = "capped"
    holds_apart: ClassVar[bool] = True
    misses_probes: ClassVar[str | None] = None
    threaded: ClassVar[bool] = True

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], and clusters of its volumes where they are many."""
        state = start(body, attachments, v)
        rows = state.rows
        if rows is None or len(rows.matrix):
            return state
        clusters = clusters_at_rest(rows, state.motion.x, state.network.inverse_mass)
        return replace(state, rows=rows._replace(clusters=clusters))

    def advance(self, state: State, drive: Drive) -> State:
        """One frame."""
        with crewed_frame(state, drive) as after:
            if after.rows is None:
                lam = implicit_volume_frame(
                    after.network, after.motion, drive, after.tally, float(after.lam[0]), after.probing
                )
                return replace(after, lam=np.array([lam]))
            after.rows.lam[:] = after.lam + after.network.rest_lam
            accuracy = Accuracy(self.tolerance, self.most_iterations)
            implicit_volumes_frame(after.network, after.rows, after.motion, drive, after.tally, accuracy, after.probing)
            return replace(after, lam=after.rows.lam - after.network.rest_lam)
