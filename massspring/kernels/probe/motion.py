"""Motion of the nodes near a thin tip with the current contacts, and the transfer of these contacts to the step."""

import math

from massspring.kernels.contact.modes import FREE
from massspring.kernels.contact.node_contact import allowed_part
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.probe.pressure import swelling


@njit_lean
def gather(stage, push):
    """u_i of the corners of all near triangles (eq. 3.4, 3.5), and v⁺ = u."""
    nodes, contacts, probes = stage.nodes, stage.contacts, stage.probes
    triangles, weight = probes.surface, stage.model.inverse_mass
    v, f, base, velocity = nodes.v_star, push.direction, probes.base, probes.velocity
    for p in range(probes.radius.shape[0]):
        for n in range(probes.near_count[p]):
            for k in range(3):
                i = triangles[probes.near[p, n], k]
                w = stage.dt * push.factor * weight[i]
                u0, u1, u2 = v[i, 0] + w * f[i, 0], v[i, 1] + w * f[i, 1], v[i, 2] + w * f[i, 2]
                if contacts.mode[i] > FREE:
                    d0, d1, d2 = contacts.direction[i, 0], contacts.direction[i, 1], contacts.direction[i, 2]
                    u0, u1, u2 = allowed_part(contacts.mode[i], d0, d1, d2, u0, u1, u2)
                    u0, u1, u2 = (
                        u0 + contacts.v_target[i, 0],
                        u1 + contacts.v_target[i, 1],
                        u2 + contacts.v_target[i, 2],
                    )
                base[i, 0], base[i, 1], base[i, 2] = u0, u1, u2
                velocity[i, 0], velocity[i, 1], velocity[i, 2] = u0, u1, u2


@njit_lean
def carried_speed(stage, i):
    """Velocity of a carried node [m/s]: that of its tip plus that relative to the tip (eq. 11.7)."""
    tips, push, dt, step = stage.tips, stage.probes.push, stage.dt, stage.step
    p = stage.probes.carried[i] - 1
    return (
        push[i, 0] + (tips.end[step, p, 0] - tips.start[step, p, 0]) / dt,
        push[i, 1] + (tips.end[step, p, 1] - tips.start[step, p, 1]) / dt,
        push[i, 2] + (tips.end[step, p, 2] - tips.start[step, p, 2]) / dt,
    )


@njit_lean
def move(stage, volumes):
    """v⁺_i = u_i + push_i + dt W̃_i (Jᵀ δ)_i of the near corners, or as they are carried [m/s] (eq. 11.6, 11.7)."""
    probes, triangles, base, push = stage.probes, stage.probes.surface, stage.probes.base, stage.probes.push
    for p in range(probes.radius.shape[0]):
        for n in range(probes.near_count[p]):
            for k in range(3):
                i = triangles[probes.near[p, n], k]
                if probes.carried[i] > 0:
                    u0, u1, u2 = carried_speed(stage, i)
                else:
                    s0, s1, s2 = swelling(stage, volumes, i)
                    u0, u1, u2 = (
                        base[i, 0] + push[i, 0] + s0,
                        base[i, 1] + push[i, 1] + s1,
                        base[i, 2] + push[i, 2] + s2,
                    )
                probes.velocity[i, 0], probes.velocity[i, 1], probes.velocity[i, 2] = u0, u1, u2


@njit_lean
def settle(stage):
    """Adds the pushes of the contacts to v*, and their impulses to probes and attachments [N s]."""
    probes, model, rows, diagnostics = stage.probes, stage.model, stage.probes.rows, stage.probes.diagnostics
    first = diagnostics.contact_impulse.shape[0] - probes.radius.shape[0]
    for k in range(rows.count[0]):
        for axis in range(3):
            diagnostics.contact_impulse[first + rows.probe[k], axis] += rows.impulse[k] * rows.direction[k, axis]
        for q in range(3):
            i = rows.node[k, q]
            for axis in range(3):
                stage.nodes.v_star[i, axis] += probes.push[i, axis]
                probes.push[i, axis] = 0.0
            if model.inverse_mass[i] == 0.0:
                for h in range(model.held_nodes.shape[0]):
                    if model.held_nodes[h] == i:
                        for axis in range(3):
                            share = rows.weight[k, q] * rows.impulse[k] * rows.direction[k, axis]
                            diagnostics.held_impulse[model.held_group[h], axis] -= share


@njit_lean
def longest_way(tips, step):
    """Longest displacement of a tip in the step [m]."""
    longest = 0.0
    for p in range(tips.end.shape[1]):
        square = 0.0
        for axis in range(3):
            square += (tips.end[step, p, axis] - tips.start[step, p, axis]) ** 2
        longest = max(longest, math.sqrt(square))
    return longest
