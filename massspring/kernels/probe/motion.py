"""Motion of the nodes near a thin tip with the current contacts, and the transfer of these contacts to the step."""

import math

from massspring.kernels.contact.node_contact import after_contact
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.vec3 import add_to, dot, minus, over, plus, put, row, take_from, times
from massspring.kernels.probe.pressure import swelling


@njit_lean
def gather(stage, push):
    """u_i of the corners of all near triangles (eq. 3.4, 3.5), and v⁺ = u."""
    probes, weight = stage.probes, stage.model.inverse_mass
    for p in range(probes.radius.shape[0]):
        for n in range(probes.near_count[p]):
            for k in range(3):
                i = probes.surface[probes.near[p, n], k]
                w = stage.dt * push.factor * weight[i]
                pushed = plus(row(stage.nodes.v_star, i), times(w, row(push.direction, i)))
                u = after_contact(stage.contacts, i, pushed)
                put(probes.base, i, u)
                put(probes.velocity, i, u)


@njit_lean
def carried_speed(stage, i):
    """Velocity of a carried node [m/s]: that of its tip plus that relative to the tip (eq. 11.7)."""
    p = stage.probes.carried[i] - 1
    return plus(row(stage.probes.push, i), over(tip_way(stage.tips, stage.step, p), stage.dt))


@njit_lean
def move(stage, volumes):
    """v⁺_i = u_i + push_i + dt W̃_i (Jᵀ δ)_i of the near corners, or as they are carried [m/s] (eq. 11.6, 11.7)."""
    probes = stage.probes
    for p in range(probes.radius.shape[0]):
        for n in range(probes.near_count[p]):
            for k in range(3):
                i = probes.surface[probes.near[p, n], k]
                if probes.carried[i] > 0:
                    u = carried_speed(stage, i)
                else:
                    u = plus(plus(row(probes.base, i), row(probes.push, i)), swelling(stage, volumes, i))
                put(probes.velocity, i, u)


@njit_lean
def settle(stage):
    """Adds the pushes of the contacts to v*, and their impulses to probes and attachments [N s]."""
    probes, model, rows, diagnostics = stage.probes, stage.model, stage.probes.rows, stage.probes.diagnostics
    first = diagnostics.contact_impulse.shape[0] - probes.radius.shape[0]
    for k in range(rows.count[0]):
        n = row(rows.direction, k)
        add_to(diagnostics.contact_impulse, first + rows.probe[k], times(rows.impulse[k], n))
        for q in range(3):
            i = rows.node[k, q]
            add_to(stage.nodes.v_star, i, row(probes.push, i))
            put(probes.push, i, (0.0, 0.0, 0.0))
            if model.inverse_mass[i] == 0.0:
                for h in range(model.held_nodes.shape[0]):
                    if model.held_nodes[h] == i:
                        share = times(rows.weight[k, q] * rows.impulse[k], n)
                        take_from(diagnostics.held_impulse, model.held_group[h], share)


@njit_lean
def longest_way(tips, step):
    """Longest displacement of a tip in the step [m]."""
    longest = 0.0
    for p in range(tips.end.shape[1]):
        way = tip_way(tips, step, p)
        longest = max(longest, math.sqrt(dot(way, way)))
    return longest


@njit_lean
def tip_way(tips, step, p):
    """Displacement of a tip in the step [m]."""
    return minus(row(tips.end[step], p), row(tips.start[step], p))
