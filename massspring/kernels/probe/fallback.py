"""The last resort where contacts alone cannot clear a step: nodes move with a tip (docs/theory.md, eq. 11.7).

A triangle whose nodes are all carried is at rest relative to the tip, so the tip cannot pass it. A triangle with a held
corner still turns: its carried corners then move ahead of the tip until the point that was passed is at rest too. If
all three corners are held, the tip goes through, and the run records it.
"""

import math

from massspring.kernels.arrays.layout import Push
from massspring.kernels.contact.node_contact import FREE, STICKS
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.vec3 import add_to, dot, minus, over, plus, put, row, times
from massspring.kernels.probe.arrays import CARRIED, CARRYING, LEFT_BEHIND
from massspring.kernels.probe.broad_phase import ROOM, find_near
from massspring.kernels.probe.contacts import clear_push
from massspring.kernels.probe.motion import carried_speed, gather, move
from massspring.kernels.probe.pressure import answer_into, faster_by, prepare, pressed_on
from massspring.kernels.probe.search import look

CARRY_ROUNDS = 400
"""Most rounds of carrying more nodes, or of moving them farther ahead."""
LEFT = 1e-9
"""Share of G·W̃·G that the nodes that are not carried must have to correct the volume alone."""
FREE_SHARE = 0.02
"""Weight of the carried corners at the contact point below which a triangle counts as held: to stay ahead, a free
corner would have to move fifty times as far as the tip."""


@njit_lean
def carry_node(stage, p, i):
    """Carries node i with the tip of probe p; from then on pressures do not move it."""
    probes, contacts = stage.probes, stage.contacts
    probes.carried[i] = p + 1
    probes.taken[probes.taken_count[0]] = i
    probes.taken_count[0] += 1
    probes.counts[CARRIED] += 1
    contacts.mode[i] = STICKS
    # The velocity without contact; `gather` no longer needs `v_target`.
    put(contacts.v_target, i, row(probes.base, i))


@njit_lean
def overshoot(stage, p, n):
    """Moves the carried corners of the near triangle n ahead, so that its passed point is at rest relative to the tip.

    The corners share Σ b_i Δ_i = −(motion of the point towards the tip) by their weights. Returns whether there are
    any.
    """
    probes, radius, f = stage.probes, stage.probes.radius[p], stage.probes.near[p, n]
    square, free, shift = 0.0, 0.0, (0.0, 0.0, 0.0)
    for k in range(3):
        i, b = probes.surface[f, k], probes.passing[n, k]
        if probes.carried[i] > 0:
            square += b * b
            free += b
        shift = minus(shift, times(b, row(probes.velocity, i)))
    if free < FREE_SHARE:
        return False
    way = minus(row(probes.pair.tip, 1), row(probes.pair.tip, 0))
    shift = plus(shift, over(way, stage.dt))
    length = math.sqrt(dot(shift, shift))
    if not length > 0.0:
        return False
    # One radius farther, so that it does not end on the tip.
    farther = (1.0 + radius / (stage.dt * length)) / square
    for k in range(3):
        i = probes.surface[f, k]
        if probes.carried[i] > 0:
            add_to(probes.push, i, times(farther * probes.passing[n, k], shift))
    return True


@njit_lean
def carry_triangles(stage, p):
    """Carries the free corners of all triangles that the tip of probe p passes, or moves carried ones ahead; whether
    any."""
    probes, model, contacts = stage.probes, stage.model, stage.contacts
    more = False
    look(stage, p)
    for n in range(probes.near_count[p]):
        if not probes.time[n] <= 1.0:
            continue
        fresh = False
        for k in range(3):
            i = probes.surface[probes.near[p, n], k]
            if model.inverse_mass[i] > 0.0 and contacts.mode[i] == FREE:
                carry_node(stage, p, i)
                fresh = True
        more |= fresh or overshoot(stage, p, n)
    return more


@njit_lean
def compensate_volume(stage, volumes):
    """δ with dt S δ = −J (v − u) of the carried nodes: the other nodes correct the volumes (eq. 11.7).

    Returns a bound on the velocity that δ adds to a node [m/s].
    """
    probes, nodes, contacts = stage.probes, stage.nodes, stage.contacts
    flow, answer, change = probes.rows.flow[0], probes.rows.answer[0], probes.change
    for r in range(change.shape[0]):
        flow[r], answer[r], change[r] = 0.0, 0.0, 0.0
    taken = 0.0
    for k in range(probes.taken_count[0]):
        i = probes.taken[k]
        s = minus(carried_speed(stage, i), row(contacts.v_target, i))
        if volumes is None:
            g = row(nodes.gradient, i)
            flow[0] -= dot(g, s)
            taken += stage.model.inverse_mass[i] * dot(g, g)
        else:
            for t in range(volumes.node_start[i], volumes.node_start[i + 1]):
                flow[volumes.node_row[t]] -= dot(row(volumes.value, volumes.node_entry[t]), s)
    if volumes is None:
        left = stage.mobility - taken
        answer[0] = flow[0] / left if left > LEFT * stage.mobility else 0.0
    else:
        prepare(stage, volumes)
        answer_into(stage, volumes, flow, answer)
    felt = 0.0
    for r in range(change.shape[0]):
        change[r] = answer[r] / stage.dt
        felt += flow[r] * answer[r]
    return faster_by(stage, felt)


@njit_lean
def carry(stage, volumes, push, plain, horizon):
    """Moves the nodes of triangles that a tip would pass with the tip or ahead of it, so that it passes none (eq.
    11.7).

    Returns the factor of the push with carried nodes, and a bound on the displacement of any node [m].
    """
    probes = stage.probes
    clear_push(probes.rows, probes.push)
    probes.rows.count[0] = 0
    probes.change[:] = 0.0
    reach = plain
    for _ in range(CARRY_ROUNDS):
        move(stage, volumes)
        more = False
        for p in range(probes.radius.shape[0]):
            more |= carry_triangles(stage, p)
        if not more:
            break
        fastest = 0.0
        for k in range(probes.taken_count[0]):
            s = carried_speed(stage, probes.taken[k])
            fastest = max(fastest, math.sqrt(dot(s, s)))
        reach = plain + stage.dt * (fastest + compensate_volume(stage, volumes))
        if reach > horizon:
            horizon = ROOM * reach
            find_near(stage.nodes, stage.tips, stage.step, probes, horizon)
            gather(stage, push)
    probes.counts[CARRYING] += 1
    note_passed(stage)
    factor = pressed_on(stage, volumes, push)
    settle_carried(stage, Push(push.direction, factor))
    return factor, reach


@njit_lean
def note_passed(stage):
    """Counts the step if a tip still goes through a triangle, and records the first such triangle of each tip."""
    probes = stage.probes
    passed = False
    for p in range(probes.radius.shape[0]):
        first = look(stage, p)
        if first <= 1.0:
            passed = True
            for n in range(probes.near_count[p]):
                if probes.time[n] == first and probes.passed[p] == 0:
                    probes.passed[p] = 1 + probes.number[probes.near[p, n]]
    probes.counts[LEFT_BEHIND] += passed


@njit_lean
def settle_carried(stage, push):
    """Changes v* so that carried nodes end the step where they were carried; adds the impulses of the tips [N s]."""
    probes, model, nodes, contacts = stage.probes, stage.model, stage.nodes, stage.contacts
    impulse = probes.diagnostics.contact_impulse
    first = impulse.shape[0] - probes.radius.shape[0]
    for k in range(probes.taken_count[0]):
        i = probes.taken[k]
        p = probes.carried[i] - 1
        w = stage.dt * push.factor * model.inverse_mass[i]
        pushed = minus(carried_speed(stage, i), times(w, row(push.direction, i)))
        gain = minus(pushed, row(nodes.v_star, i))
        add_to(nodes.v_star, i, gain)
        add_to(impulse, first + p, times(model.mass[i], gain))
        put(probes.push, i, (0.0, 0.0, 0.0))
        probes.carried[i], contacts.mode[i] = 0, FREE
    probes.taken_count[0] = 0
