"""The loop of all variants of implicit constraint enforcement that keep one volume (docs/theory.md, section 10).

With ṽ, W̃ of eq. 3.4 each of them ends a step at v⁺ = ṽ + dt lam W̃ G, x⁺ = x + dt v⁺. They differ in where G is taken,
in the length of the step along it, and in whether a correction of the positions changes the velocities.

Contacts of thin probes come after the multiplier and do not change G·v⁺ (eq. 11.6), so the condition of a rule on the
rate of V still holds. An exact root then holds to first order in the motion by these contacts; the next step starts
from the true V, so that errors do not accumulate. Nothing may move after that stage, since the search for crossings
would miss a correction of the positions.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from massspring.kernels.arrays.layout import BoundaryConditions, Push
from massspring.kernels.constraint.exact_volume import LineSearch, line_into, nearest_root, volume_cubic
from massspring.kernels.constraint.one_volume import limited_error, steepest, surely_short, volume_multiplier
from massspring.kernels.contact.active_set import pressure_reach
from massspring.kernels.contact.node_contact import allowed
from massspring.kernels.forces.volume import volume_gradient_into
from massspring.kernels.fused.chunk import pad_positions
from massspring.kernels.jit.decorators import compiled, njit_lean
from massspring.kernels.jit.stage_clock import MULTIPLIER, VOLUME, end_stage
from massspring.kernels.jit.vec3 import add_to, plus, put, row, times
from massspring.kernels.step.begin import begin_step, multiplier_stands, open_frame, search_contacts
from massspring.kernels.step.end import end_step
from massspring.layout.state import State
from massspring.methods.method import begin_frame


class Rule(NamedTuple):
    """The settings of a variant; the defaults are HCJ05."""

    pull: float = 1.0
    """Share of V0 − V that a step corrects, (beta dt)² [1]."""
    brake: float = 1.0
    """Share of dV/dt that a step stops, 2 alpha dt [1]."""
    convective: bool = False
    """Whether the convective term vᵀ H v, the change of G along the motion, is included."""
    exact: bool = False
    """Whether the step ends at V0 exactly, at the nearest root of the cubic, instead of at the linearised V0."""
    at_prediction: bool = False
    """Whether G is taken at x + dt v* instead of x; only with `exact`."""
    stabilised: bool = False
    """Whether positions, but not velocities, are corrected once more after the step."""


@compiled
def inertial_change(model, nodes, rule, dt):
    """dt (1 − 2 alpha dt) G·v − dt² vᵀHv [m³], the part of the old change of volume that a step retains (eq. 10.5)."""
    change = 0.0
    if rule.brake != 1.0:
        for i in range(nodes.v.shape[0]):
            change += nodes.gradient[i, 0] * nodes.v[i, 0]
            change += nodes.gradient[i, 1] * nodes.v[i, 1]
            change += nodes.gradient[i, 2] * nodes.v[i, 2]
        change *= dt * (1.0 - rule.brake)
    if rule.convective:
        _, _, half, _ = volume_cubic(nodes.x, nodes.v, model.triangles)
        change -= 2.0 * dt * dt * half
    return change


@compiled
def linear_multiplier(model, nodes, contacts, error, kept, dt, whole):
    """lam [Pa], G·W̃·G, and whether the error was limited, for a step that corrects `error` [m³] and retains the change
    of volume `kept` [m³].

    With `whole` the error is not limited (eq. 3.3, 8.5, 10.5).
    """
    lam, mobility = volume_multiplier(nodes, contacts, model.inverse_mass, error + kept, dt)
    lightest, longest = model.largest_inverse_mass, model.correction_limit
    if whole or not mobility > 0.0 or surely_short(error, mobility, lightest, longest):
        return lam, mobility, False
    part = limited_error(error, mobility, steepest(nodes.gradient, model.inverse_mass), longest)
    if part != error:
        lam, mobility = volume_multiplier(nodes, contacts, model.inverse_mass, part + kept, dt)
    return lam, mobility, part != error


@compiled
def exact_multiplier(model, nodes, contacts, line, target, mobility, dt):
    """lam [Pa] with V(y + lam d) = V0, the root of smallest modulus (eq. 10.1, 10.2), and G·W̃·G; (0, 0) without a
    root."""
    line_into(nodes, contacts, model.inverse_mass, dt, line)
    volume, k1, k2, k3 = volume_cubic(line.y, line.d, model.triangles)
    lam = nearest_root(volume - target, k1, k2, k3)
    return (lam, mobility) if lam == lam else (0.0, 0.0)


@compiled
def predicted_gradient_into(model, nodes, line, dt):
    """G at x + dt v* [m²], (n, 3), before contact (eq. 2.2, 3.1)."""
    for i in range(nodes.x.shape[0]):
        put(line.y, i, plus(row(nodes.x, i), times(dt, row(nodes.v_star, i))))
    volume_gradient_into(line.y, model.triangles, nodes.gradient)


@compiled
def correct_positions(model, nodes, contacts, target, dt):
    """x += W̃ G (V0 − V)/(G·W̃·G), G at x, velocities unchanged (eq. 10.7). Returns whether the correction was limited
    (eq. 8.5)."""
    error = target - volume_gradient_into(nodes.x, model.triangles, nodes.gradient)
    _, mobility = volume_multiplier(nodes, contacts, model.inverse_mass, error, dt)
    if not mobility > 0.0:
        return False
    part = limited_error(error, mobility, steepest(nodes.gradient, model.inverse_mass), model.correction_limit)
    for i in range(nodes.x.shape[0]):
        push = model.inverse_mass[i] * part / mobility
        add_to(nodes.x, i, allowed(contacts, i, times(push, row(nodes.gradient, i))))
    return part != error


@njit_lean
def constraint_frame(frame, line, lam, rule):
    """One frame with contact inside the multiplier (eq. 3.1–3.8, 10.1–10.3, 10.5, 10.7); returns the last lam [Pa]."""
    model, nodes, contacts, boundary, diagnostics = (
        frame.model,
        frame.nodes,
        frame.contacts,
        frame.boundary,
        frame.diagnostics,
    )
    dt, mobility = boundary.dt, 0.0
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        target = boundary.volume_target[step, 0]
        volume, _ = begin_step(frame, step, True)
        error = rule.pull * (target - volume)
        kept = inertial_change(model, nodes, rule, dt)
        if rule.at_prediction:
            predicted_gradient_into(model, nodes, line, dt)
        end_stage(diagnostics.stage_times, VOLUME)
        predicted = lam
        passes = search_contacts(frame, step, Push(nodes.gradient, predicted))
        for sweep in range(passes):
            lam, mobility, limited = linear_multiplier(model, nodes, contacts, error, kept, dt, rule.exact)
            if rule.exact and mobility > 0.0:
                lam, mobility = exact_multiplier(model, nodes, contacts, line, target, mobility, dt)
            diagnostics.limited[0] += limited and sweep == 0
            reach = pressure_reach(lam - predicted, mobility, model.largest_inverse_mass, dt)
            if multiplier_stands(frame, step, Push(nodes.gradient, lam), reach, sweep + 1 == passes):
                break
        if not mobility > 0.0:
            diagnostics.singular[0] += 1
        lam = end_step(frame, step, Push(nodes.gradient, lam), mobility, None)
        if rule.stabilised:
            diagnostics.limited[0] += correct_positions(model, nodes, contacts, target, dt)
            pad_positions(nodes, frame.work, 0, nodes.x.shape[0])
            end_stage(diagnostics.stage_times, MULTIPLIER)
    return lam


def advance_by(rule: Rule, state: State, boundary: BoundaryConditions) -> State:
    """One frame by `rule`."""
    after = begin_frame(state, boundary)
    line = LineSearch(np.empty_like(after.x), np.empty_like(after.x))
    start = float(after.lam[0])
    lam = constraint_frame(after.frame(boundary), line, start, rule)
    return replace(after, lam=np.array([lam]))
