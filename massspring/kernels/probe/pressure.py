"""Pressures of the kept volumes with point contacts, for one volume, several, or none (docs/theory.md, section 11).

An impulse c of contact k changes the volumes at the rate g_k c; pressures −S⁻¹ g_k c/dt undo that, S = J W̃ Jᵀ.
"""

import math

from massspring.kernels.constraint.jacobian import diagonal_into, transposed_rows_times_into
from massspring.kernels.constraint.schur import dense_into, factor_dense, solve_iteratively, substitute
from massspring.kernels.contact.node_contact import allowed
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.vec3 import dot, plus, row, times

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
        i, b, m = rows.node[k, q], rows.weight[k, q], row(rows.moves[k], q)
        if volumes is None:
            if stage.mobility > 0.0:
                rows.flow[k, 0] += b * dot(row(stage.nodes.gradient, i), m)
        else:
            for t in range(volumes.node_start[i], volumes.node_start[i + 1]):
                rows.flow[k, volumes.node_row[t]] += b * dot(row(volumes.value, volumes.node_entry[t]), m)


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
    change, s = stage.probes.change, (0.0, 0.0, 0.0)
    if volumes is None:
        s = times(change[0], row(stage.nodes.gradient, i))
    else:
        for t in range(volumes.node_start[i], volumes.node_start[i + 1]):
            s = plus(s, times(change[volumes.node_row[t]], row(volumes.value, volumes.node_entry[t])))
    return allowed(stage.contacts, i, times(stage.dt * stage.model.inverse_mass[i], s))


@njit_lean
def pressed_on(stage, volumes, push):
    """The factor of the push after the change of pressures; with several volumes the push itself changes."""
    if volumes is None:
        return push.factor + stage.probes.change[0]
    for r in range(volumes.lam.shape[0]):
        volumes.lam[r] += stage.probes.change[r]
    transposed_rows_times_into(volumes, volumes.lam, volumes.push)
    return push.factor
