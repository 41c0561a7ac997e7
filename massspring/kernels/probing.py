"""The stage of thin probes in a step: what a tip runs into, the contacts that stop it, and a last resort.

Nothing is left to the size of a step: the motion that the step will make is searched for crossings, each becomes a
contact, and the search begins again until nothing crosses (docs/theory.md, section 11).
"""

import math

from massspring.kernels.broad_phase import ROOM, fastest_node, find_near
from massspring.kernels.collision import NEVER, crossing, nearest_into, touching
from massspring.kernels.compiled import compiled
from massspring.kernels.contact import pressure_reach
from massspring.kernels.point_contacts import free_velocity, row_of, set_row, solve_rows, spread_push
from massspring.kernels.probe_layout import Stage

PASSES = 24
"""Searches for what the last solution runs into; each adds contacts or turns one."""
SAME_TIME = 1e-6
"""Of a step: triangles that share the edge or corner that is met are met together."""
ENOUGH = 0.95
"""Share of the radius left at which a contact is not turned once more: what is missing is second order in the step."""
CARRIES = 200
"""Rounds of the last resort, each of which takes more nodes along."""


@compiled
def probe_velocity(stage, p):
    """Mean over the step [m/s]."""
    s, e = stage.tips.start[stage.step, p], stage.tips.end[stage.step, p]
    return (e[0] - s[0]) / stage.dt, (e[1] - s[1]) / stage.dt, (e[2] - s[2]) / stage.dt


@compiled
def pair_into(stage, p, f, lam):
    """Corners of a triangle seen from a tip, at the start of the step and at its end [m]."""
    x, pair, carried, dt = stage.motion.x, stage.probes.pair, stage.probes.carried, stage.dt
    s, e = stage.tips.start[stage.step, p], stage.tips.end[stage.step, p]
    for k in range(3):
        i = stage.network.triangles[f, k]
        u0, u1, u2 = free_velocity(stage, i, lam) if carried[i] == 0 else probe_velocity(stage, carried[i] - 1)
        pair.begin[k, 0], pair.begin[k, 1], pair.begin[k, 2] = x[i, 0] - s[0], x[i, 1] - s[1], x[i, 2] - s[2]
        pair.end[k, 0] = pair.begin[k, 0] + (dt * u0 - (e[0] - s[0]))
        pair.end[k, 1] = pair.begin[k, 1] + (dt * u1 - (e[1] - s[1]))
        pair.end[k, 2] = pair.begin[k, 2] + (dt * u2 - (e[2] - s[2]))


@compiled
def first_crossing(stage, p, lam):
    """When the tip first passes through a triangle in the step as it stands, 0 … 1, or NEVER."""
    first = NEVER
    for q in range(stage.probes.near_count[p]):
        pair_into(stage, p, stage.probes.near[p, q], lam)
        first = min(first, crossing(stage.probes.pair))
    stage.probes.counts[5] += stage.probes.near_count[p]
    return first


@compiled
def add_crossings(stage, p, lam, first):
    """A contact for every triangle that the tip passes through at the first time; how many found room.

    What lies beyond it would be met only by a tip that nothing had stopped.
    """
    found, probes = 0, stage.probes
    for q in range(probes.near_count[p]):
        f = probes.near[p, q]
        pair_into(stage, p, f, lam)
        if crossing(probes.pair) <= first + SAME_TIME:
            found += set_row(probes.rows, row_of(probes.rows, p, f), p, f, probes.pair)
    return found


@compiled
def add_touches(stage, p, lam):
    """A contact for every triangle that ends the step within the radius, where it first touches; how many found room.

    A triangle that has its contact and turned away under it gets the direction of the end of the step.
    """
    found, probes, pair = 0, stage.probes, stage.probes.pair
    for q in range(probes.near_count[p]):
        f = probes.near[p, q]
        pair_into(stage, p, f, lam)
        distance = nearest_into(pair.end, pair.weight)
        row = row_of(probes.rows, p, f)
        if row == probes.rows.count[0]:
            if distance < probes.radius[p]:
                touching(pair, probes.radius[p])
                found += set_row(probes.rows, row, p, f, pair)
        elif distance < ENOUGH * probes.radius[p]:
            for axis in range(3):
                pair.direction[axis] = 0.0
                for k in range(3):
                    pair.direction[axis] += pair.weight[k] * pair.end[k, axis] / distance
            found += set_row(probes.rows, row, p, f, pair)
    return found


@compiled
def search(stage, lam):
    """Adds what the step as it stands runs into; (contacts that found room, whether a tip crosses)."""
    found, crosses = 0, False
    for p in range(stage.probes.radius.shape[0]):
        first = first_crossing(stage, p, lam)
        if first <= 1.0:
            crosses = True
            found += add_crossings(stage, p, lam, first)
        else:
            found += add_touches(stage, p, lam)
    return found, crosses


@compiled
def fastest_push(stage):
    """max_i w_i |Σ b n c| [m/s]: how much faster the contacts make a node."""
    fastest, rows, push = 0.0, stage.probes.rows, stage.probes.push
    for k in range(rows.count[0]):
        for q in range(3):
            i = stage.network.triangles[rows.triangle[k], q]
            square = push[i, 0] ** 2 + push[i, 1] ** 2 + push[i, 2] ** 2
            fastest = max(fastest, stage.network.inverse_mass[i] * math.sqrt(square))
    return fastest


@compiled
def carry(stage, lam, mobility):
    """The last resort: nodes of triangles that a tip would pass move with the tip, so that nothing passes it.

    Their motion is given, so the volume is left to the others. Returns the pressure beside them [Pa] (eq. 8).
    """
    probes, network, motion, dt = stage.probes, stage.network, stage.motion, stage.dt
    spread_push(stage, 0.0)
    probes.rows.count[0] = 0
    flow, taken, beside = 0.0, 0.0, lam
    for _ in range(CARRIES):
        added = 0
        for p in range(probes.radius.shape[0]):
            w0, w1, w2 = probe_velocity(stage, p)
            for q in range(probes.near_count[p]):
                f = probes.near[p, q]
                pair_into(stage, p, f, beside)
                if not crossing(probes.pair) <= 1.0:
                    continue
                for k in range(3):
                    i = network.triangles[f, k]
                    if probes.carried[i] > 0 or network.inverse_mass[i] == 0.0 or motion.locked[i] > 0:
                        continue
                    g0, g1, g2 = motion.gradient[i, 0], motion.gradient[i, 1], motion.gradient[i, 2]
                    u0, u1, u2 = free_velocity(stage, i, lam)
                    flow += g0 * (w0 - u0) + g1 * (w1 - u1) + g2 * (w2 - u2)
                    taken += network.inverse_mass[i] * (g0 * g0 + g1 * g1 + g2 * g2)
                    probes.carried[i] = p + 1
                    added += 1
        if added == 0:
            break
        left = mobility - taken
        beside = lam - flow / (dt * left) if left > 1e-9 * mobility else lam
    return beside


@compiled
def settle(stage):
    """Hands the contacts on to the step: v* takes their impulses; books them for the probes and attachments [N s]."""
    probes, network, rows, tally = stage.probes, stage.network, stage.probes.rows, stage.probes.tally
    first = tally.contact_impulse.shape[0] - probes.radius.shape[0]
    for k in range(rows.count[0]):
        for axis in range(3):
            tally.contact_impulse[first + rows.probe[k], axis] += rows.impulse[k] * rows.direction[k, axis]
    for k in range(rows.count[0]):
        for q in range(3):
            i = network.triangles[rows.triangle[k], q]
            for axis in range(3):
                stage.motion.v_star[i, axis] += network.inverse_mass[i] * probes.push[i, axis]
            if network.inverse_mass[i] == 0.0:
                for h in range(network.held_nodes.shape[0]):
                    if network.held_nodes[h] == i:
                        for axis in range(3):
                            tally.held_impulse[network.held_group[h], axis] -= probes.push[i, axis]
            for axis in range(3):
                probes.push[i, axis] = 0.0


@compiled
def settle_carried(stage, lam):
    """Carried nodes end the step with their tip, whose impulse on them is booked [N s]."""
    probes, motion, tally = stage.probes, stage.motion, stage.probes.tally
    first = tally.contact_impulse.shape[0] - probes.radius.shape[0]
    for i in range(probes.carried.shape[0]):
        if probes.carried[i] == 0:
            continue
        p = probes.carried[i] - 1
        w0, w1, w2 = probe_velocity(stage, p)
        u0, u1, u2 = free_velocity(stage, i, lam)
        motion.v_star[i, 0] += w0 - u0
        motion.v_star[i, 1] += w1 - u1
        motion.v_star[i, 2] += w2 - u2
        mass = stage.network.mass[i]
        tally.contact_impulse[first + p, 0] += mass * (w0 - u0)
        tally.contact_impulse[first + p, 1] += mass * (w1 - u1)
        tally.contact_impulse[first + p, 2] += mass * (w2 - u2)
        probes.carried[i] = 0


@compiled
def carry_until_clear(stage, lam, mobility, plain, horizon):
    """`carry`, over again while the others' new pressure moves them farther than pairs were looked for [Pa], [m]."""
    probes, network = stage.probes, stage.network
    lightest = network.inverse_mass.max()
    beside, reach = lam, plain
    for _ in range(CARRIES):
        beside = carry(stage, lam, mobility)
        reach = plain + pressure_reach(beside - lam, mobility, lightest, stage.dt)
        if reach <= horizon:
            break
        horizon = ROOM * reach
        find_near(network, stage.motion, stage.tips, stage.step, probes, horizon)
    probes.counts[2] += 1
    passed = False
    for p in range(probes.radius.shape[0]):
        passed |= first_crossing(stage, p, beside) <= 1.0
    probes.counts[3] += passed
    settle_carried(stage, beside)
    return beside, reach


@compiled
def longest_way(stage):
    """Of any tip in the step [m]."""
    longest = 0.0
    for p in range(stage.probes.radius.shape[0]):
        w0, w1, w2 = probe_velocity(stage, p)
        longest = max(longest, stage.dt * math.sqrt(w0 * w0 + w1 * w1 + w2 * w2))
    return longest


@compiled
def meet_probes(network, motion, drive, step, probes, lam, mobility):
    """Contact with thin probes, once lam and the other contacts of the step are known; the pressure beside it [Pa].

    `mobility` is G·W̃·G [m⁴/kg]; 0 where no volume is kept (eq. 141–147).
    """
    stage = Stage(network, motion, drive.tips, probes, step, drive.dt)
    plain = drive.dt * fastest_node(network, motion, lam, drive.dt) + longest_way(stage)
    if not plain < math.inf:
        return lam
    lightest = network.inverse_mass.max()
    reach, horizon, beside, crosses = plain, ROOM * plain, lam, False
    find_near(network, motion, drive.tips, step, probes, horizon)
    probes.rows.count[0] = 0
    for sweep in range(PASSES):
        found, crosses = search(stage, beside)
        if found == 0 or sweep + 1 == PASSES:
            break
        beside = solve_rows(stage, lam, mobility)
        probes.counts[1] += 1
        reach = plain + drive.dt * fastest_push(stage) + pressure_reach(beside - lam, mobility, lightest, drive.dt)
        if reach > horizon:
            horizon = ROOM * reach
            find_near(network, motion, drive.tips, step, probes, horizon)
    probes.counts[0] += probes.rows.count[0] > 0
    if crosses:
        beside, reach = carry_until_clear(stage, lam, mobility, plain, horizon)
    elif probes.rows.count[0] > 0:
        settle(stage)
    probes.travel[0] += reach
    return beside
