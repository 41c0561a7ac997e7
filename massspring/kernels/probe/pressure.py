"""Pressures of the kept volumes with point contacts, for one volume, several, or none (docs/theory.md, section 11).

An impulse c of contact k changes the volumes at the rate g_k c; pressures −S⁻¹ g_k c/dt undo that, S = J W̃ Jᵀ.
"""

import math

from massspring.kernels.constraint.jacobian import diagonal_into, transposed_rows_times_into
from massspring.kernels.constraint.schur import dense_into, factor_dense, solve_iteratively, substitute
from massspring.kernels.contact.modes import FREE
from massspring.kernels.contact.node_contact import allowed_part
from massspring.kernels.jit.decorators import njit_lean

ACCURATE = 1e-7
"""Residual that an iterative solve may leave, over the largest flow. The next step corrects it, as any volume error."""
MOST_ITERATIONS = 400


@njit_lean
def prepare(stage, volumes):
    """S for the current contacts, factored if it is dense (eq. 8.3)."""
    if volumes is not None:
        diagonal_into(volumes, stage.contacts, stage.model.inverse_mass, volumes.diagonal)
        if volumes.matrix.shape[0] > 0:
            dense_into(volumes, stage.contacts, stage.model.inverse_mass, volumes.matrix)
            factor_dense(volumes.matrix)


@njit_lean
def flow_into(stage, volumes, k):
    """g_k = Σ_i b_i J_i W̃_i n [m²/kg] of row k (eq. 11.6)."""
    rows = stage.probes.rows
    for r in range(rows.flow.shape[1]):
        rows.flow[k, r] = 0.0
    for q in range(3):
        i, b, m = rows.node[k, q], rows.weight[k, q], rows.moves
        if volumes is None:
            g = stage.nodes.gradient
            if stage.mobility > 0.0:
                rows.flow[k, 0] += b * (g[i, 0] * m[k, q, 0] + g[i, 1] * m[k, q, 1] + g[i, 2] * m[k, q, 2])
        else:
            for t in range(volumes.node_start[i], volumes.node_start[i + 1]):
                e, r = volumes.node_entry[t], volumes.node_row[t]
                j = volumes.value
                rows.flow[k, r] += b * (j[e, 0] * m[k, q, 0] + j[e, 1] * m[k, q, 1] + j[e, 2] * m[k, q, 2])


@njit_lean
def answer_into(stage, volumes, flow, answer):
    """S⁻¹ g [1/m²], (m,): the division of one volume, a back-solve of few, an iteration for many (eq. 8.3, 8.4)."""
    if volumes is None:
        for r in range(flow.shape[0]):
            answer[r] = flow[r] / stage.mobility if stage.mobility > 0.0 else 0.0
    elif volumes.matrix.shape[0] > 0:
        substitute(volumes.matrix, flow, answer)
    else:
        largest = 0.0
        for r in range(flow.shape[0]):
            largest = max(largest, abs(flow[r]))
        for r in range(flow.shape[0]):
            volumes.right[r], volumes.allowed[r], answer[r] = flow[r], ACCURATE * largest, 0.0
        solve_iteratively(volumes, stage.contacts, stage.model.inverse_mass, answer, volumes.allowed, MOST_ITERATIONS)


@njit_lean
def change_of_rows(stage):
    """δ = −Σ_k S⁻¹ g_k c_k/dt [Pa]; returns a bound on the velocity it adds to a node, √(max w · δ·S δ) dt [m/s] (eq.
    11.6)."""
    rows, change = stage.probes.rows, stage.probes.change
    felt = 0.0
    for r in range(change.shape[0]):
        flow, answer = 0.0, 0.0
        for k in range(rows.count[0]):
            flow += rows.flow[k, r] * rows.impulse[k]
            answer += rows.answer[k, r] * rows.impulse[k]
        change[r] = -answer / stage.dt
        felt += flow * answer
    return faster_by(stage, felt)


@njit_lean
def faster_by(stage, felt):
    """√(max w · dt² δ·S δ) ≥ dt w_i |(Jᵀ δ)_i| [m/s]: bound on the velocity that pressures add to any free node."""
    return 1.0001 * math.sqrt(max(stage.model.largest_inverse_mass * felt, 0.0))


@njit_lean
def swelling(stage, volumes, i):
    """dt W̃_i (Jᵀ δ)_i [m/s], the velocity that the change of pressures adds to node i (eq. 11.6)."""
    nodes, contacts, change = stage.nodes, stage.contacts, stage.probes.change
    s0, s1, s2 = 0.0, 0.0, 0.0
    if volumes is None:
        g, p = nodes.gradient, change[0]
        s0, s1, s2 = p * g[i, 0], p * g[i, 1], p * g[i, 2]
    else:
        for t in range(volumes.node_start[i], volumes.node_start[i + 1]):
            e, p = volumes.node_entry[t], change[volumes.node_row[t]]
            s0 += p * volumes.value[e, 0]
            s1 += p * volumes.value[e, 1]
            s2 += p * volumes.value[e, 2]
    push = stage.dt * stage.model.inverse_mass[i]
    s0, s1, s2 = push * s0, push * s1, push * s2
    if contacts.mode[i] > FREE:
        d0, d1, d2 = contacts.direction[i, 0], contacts.direction[i, 1], contacts.direction[i, 2]
        s0, s1, s2 = allowed_part(contacts.mode[i], d0, d1, d2, s0, s1, s2)
    return s0, s1, s2


@njit_lean
def pressed_on(stage, volumes, push):
    """The factor of the push after the change of pressures; with several volumes the push itself changes."""
    if volumes is None:
        return push.factor + stage.probes.change[0]
    for r in range(volumes.lam.shape[0]):
        volumes.lam[r] += stage.probes.change[r]
    transposed_rows_times_into(volumes, volumes.lam, volumes.push)
    return push.factor
