"""The stage of thin probes in a step: what a tip runs into, the contacts that stop it, and a last resort.

Nothing is left to the size of a step: the motion that the step will make is searched for crossings, each becomes a
contact, and the search begins again until nothing crosses (docs/theory.md, section 11).
"""

import math

from massspring.kernels.broad_phase import ROOM, fastest_node, find_near
from massspring.kernels.collision import NEVER, crossing, nearest_into, touching
from massspring.kernels.compiled import lean
from massspring.kernels.contact import pressure_reach
from massspring.kernels.distances import allowed_part
from massspring.kernels.point_contacts import clear_push, row_of, set_row, solve_rows
from massspring.kernels.probe_layout import Stage

PASSES = 24
"""Searches for what the last solution runs into; each adds contacts or turns one."""
SAME_TIME = 1e-6
"""Of a step: triangles that share the edge or corner that is met are met together."""
ENOUGH = 0.95
"""Share of the radius left at which a contact is not turned once more: what is missing is second order in the step."""
CARRIES = 200
"""Rounds of the last resort, each of which takes more nodes along."""
LEFT = 1e-9
"""Share of G·W̃·G that nodes that are not carried must have for the volume to be left to them."""


@lean
def gather(stage, lam):
    """u_i and W̃_i G_i of the corners of all near triangles (eq. 9, 10), and v⁺ = u."""
    motion, probes, triangles, weight = stage.motion, stage.probes, stage.network.triangles, stage.network.inverse_mass
    v, g, base, drift, velocity = motion.v_star, motion.gradient, probes.base, probes.drift, probes.velocity
    for p in range(probes.radius.shape[0]):
        for n in range(probes.near_count[p]):
            for k in range(3):
                i = triangles[probes.near[p, n], k]
                w = weight[i]
                g0, g1, g2, v0, v1, v2 = g[i, 0], g[i, 1], g[i, 2], v[i, 0], v[i, 1], v[i, 2]
                o0, o1, o2 = 0.0, 0.0, 0.0
                if motion.locked[i] > 0:
                    d0, d1, d2 = motion.direction[i, 0], motion.direction[i, 1], motion.direction[i, 2]
                    g0, g1, g2 = allowed_part(motion.locked[i], d0, d1, d2, g0, g1, g2)
                    v0, v1, v2 = allowed_part(motion.locked[i], d0, d1, d2, v0, v1, v2)
                    o0, o1, o2 = motion.goal[i, 0], motion.goal[i, 1], motion.goal[i, 2]
                drift[i, 0], drift[i, 1], drift[i, 2] = w * g0, w * g1, w * g2
                push = stage.dt * lam * w
                base[i, 0], base[i, 1], base[i, 2] = v0 + push * g0 + o0, v1 + push * g1 + o1, v2 + push * g2 + o2
                velocity[i, 0], velocity[i, 1], velocity[i, 2] = base[i, 0], base[i, 1], base[i, 2]


@lean
def move(stage, change):
    """v⁺_i = u_i + push_i + dt δ W̃_i G_i of the near corners, or the tip's where it carries them [m/s] (eq. 146, 147).

    `change` is δ [Pa].
    """
    probes, triangles = stage.probes, stage.network.triangles
    base, push, drift, velocity = probes.base, probes.push, probes.drift, probes.velocity
    swell = stage.dt * change
    for p in range(probes.radius.shape[0]):
        for n in range(probes.near_count[p]):
            for k in range(3):
                i = triangles[probes.near[p, n], k]
                for axis in range(3):
                    if probes.carried[i] == 0:
                        velocity[i, axis] = base[i, axis] + push[i, axis] + swell * drift[i, axis]
                    else:
                        q = probes.carried[i] - 1
                        way = stage.tips.end[stage.step, q, axis] - stage.tips.start[stage.step, q, axis]
                        velocity[i, axis] = way / stage.dt


@lean
def pair_into(pair, x, velocity, triangles, f, dt):
    """Corners of a triangle seen from the tip of `pair`, at the start of the step and at its end [m]."""
    for k in range(3):
        i = triangles[f, k]
        for axis in range(3):
            pair.begin[k, axis] = x[i, axis] - pair.tip[0, axis]
            way = dt * velocity[i, axis] - (pair.tip[1, axis] - pair.tip[0, axis])
            pair.end[k, axis] = pair.begin[k, axis] + way


@lean
def look(stage, p):
    """When and where the tip passes through each near triangle in the step as it stands; the first time, or NEVER."""
    probes, x, triangles, pair = stage.probes, stage.motion.x, stage.network.triangles, stage.probes.pair
    for axis in range(3):
        pair.tip[0, axis] = stage.tips.start[stage.step, p, axis]
        pair.tip[1, axis] = stage.tips.end[stage.step, p, axis]
    first = NEVER
    for n in range(probes.near_count[p]):
        pair_into(pair, x, probes.velocity, triangles, probes.near[p, n], stage.dt)
        t = crossing(pair)
        probes.time[n] = t
        if t <= 1.0:
            first = min(first, t)
            for k in range(3):
                probes.found[n, k], probes.found[n, 3 + k] = pair.weight[k], pair.direction[k]
    probes.counts[5] += probes.near_count[p]
    return first


@lean
def add_crossings(probes, triangles, p, first):
    """A contact for every triangle that the tip passes through at the first time; how many found room.

    What lies beyond it would be met only by a tip that nothing had stopped.
    """
    room = 0
    for n in range(probes.near_count[p]):
        if probes.time[n] <= first + SAME_TIME:
            for k in range(3):
                probes.pair.weight[k], probes.pair.direction[k] = probes.found[n, k], probes.found[n, 3 + k]
            room += set_row(probes.rows, p, probes.near[p, n], triangles, probes.pair)
    return room


@lean
def add_touches(stage, p):
    """A contact for every triangle that ends the step within the radius, where it first touches; how many found room.

    A triangle that has its contact and turned away under it gets the direction of the end of the step.
    """
    room, probes, pair, triangles = 0, stage.probes, stage.probes.pair, stage.network.triangles
    for n in range(probes.near_count[p]):
        f = probes.near[p, n]
        pair_into(pair, stage.motion.x, probes.velocity, triangles, f, stage.dt)
        distance = nearest_into(pair.end, pair.weight)
        if distance >= probes.radius[p]:
            continue
        if row_of(probes.rows, p, f) == probes.rows.count[0]:
            touching(pair, probes.radius[p])
        elif distance < ENOUGH * probes.radius[p]:
            for axis in range(3):
                pair.direction[axis] = 0.0
                for k in range(3):
                    pair.direction[axis] += pair.weight[k] * pair.end[k, axis] / distance
        else:
            continue
        room += set_row(probes.rows, p, f, triangles, pair)
    return room


@lean
def search(stage):
    """Adds what the step as it stands runs into; (contacts that found room, whether a tip crosses)."""
    found, crosses = 0, False
    for p in range(stage.probes.radius.shape[0]):
        first = look(stage, p)
        if first <= 1.0:
            crosses = True
            found += add_crossings(stage.probes, stage.network.triangles, p, first)
        else:
            found += add_touches(stage, p)
    return found, crosses


@lean
def take_along(stage, p):
    """Carries the free corners of all triangles that the tip of probe p passes; what they take of flow and of G·W̃·G."""
    probes, network, motion = stage.probes, stage.network, stage.motion
    g, base, tip = motion.gradient, probes.base, probes.pair.tip
    flow, taken, dt = 0.0, 0.0, stage.dt
    look(stage, p)
    for n in range(probes.near_count[p]):
        if not probes.time[n] <= 1.0:
            continue
        for k in range(3):
            i = network.triangles[probes.near[p, n], k]
            if probes.carried[i] > 0 or network.inverse_mass[i] == 0.0 or motion.locked[i] > 0:
                continue
            for axis in range(3):
                flow += g[i, axis] * ((tip[1, axis] - tip[0, axis]) / dt - base[i, axis])
                taken += network.inverse_mass[i] * g[i, axis] ** 2
            probes.carried[i] = p + 1
            probes.counts[6] += 1
    return flow, taken


@lean
def carry(stage, lam, mobility, plain, horizon):
    """The last resort: nodes of triangles that a tip would pass move with the tip, so that nothing passes it (eq. 147).

    Their motion is given, so the volume is left to the others. Returns their pressure [Pa] and what moves how far [m].
    """
    probes, dt = stage.probes, stage.dt
    clear_push(probes.rows, probes.push)
    probes.rows.count[0] = 0
    lightest = stage.network.largest_inverse_mass
    flow, taken, change, reach = 0.0, 0.0, 0.0, plain
    for _ in range(CARRIES):
        before = probes.counts[6]
        move(stage, change)
        for p in range(probes.radius.shape[0]):
            more, part = take_along(stage, p)
            flow, taken = flow + more, taken + part
        if probes.counts[6] == before:
            break
        left = mobility - taken
        change = -flow / (dt * left) if left > LEFT * mobility else 0.0
        reach = plain + pressure_reach(change, mobility, lightest, dt)
        if reach > horizon:
            horizon = ROOM * reach
            find_near(stage.network, stage.motion, stage.tips, stage.step, probes, horizon)
            gather(stage, lam)
    probes.counts[2] += 1
    passed = False
    for p in range(probes.radius.shape[0]):
        passed |= look(stage, p) <= 1.0
    probes.counts[3] += passed
    settle_carried(stage, change)
    return lam + change, reach


@lean
def settle_carried(stage, change):
    """Carried nodes end the step with their tip, whose impulse on them is booked [N s]."""
    probes, tally, dt = stage.probes, stage.probes.tally, stage.dt
    first = tally.contact_impulse.shape[0] - probes.radius.shape[0]
    for i in range(probes.carried.shape[0]):
        if probes.carried[i] > 0:
            p = probes.carried[i] - 1
            for axis in range(3):
                way = stage.tips.end[stage.step, p, axis] - stage.tips.start[stage.step, p, axis]
                gain = way / dt - probes.base[i, axis] - dt * change * probes.drift[i, axis]
                stage.motion.v_star[i, axis] += gain
                tally.contact_impulse[first + p, axis] += stage.network.mass[i] * gain
            probes.carried[i] = 0


@lean
def settle(stage):
    """Hands the contacts on to the step: v* takes their pushes; books them for probes and attachments [N s]."""
    probes, network, rows, tally = stage.probes, stage.network, stage.probes.rows, stage.probes.tally
    first = tally.contact_impulse.shape[0] - probes.radius.shape[0]
    for k in range(rows.count[0]):
        for axis in range(3):
            tally.contact_impulse[first + rows.probe[k], axis] += rows.impulse[k] * rows.direction[k, axis]
        for q in range(3):
            i = rows.node[k, q]
            for axis in range(3):
                stage.motion.v_star[i, axis] += probes.push[i, axis]
                probes.push[i, axis] = 0.0
            if network.inverse_mass[i] == 0.0:
                for h in range(network.held_nodes.shape[0]):
                    if network.held_nodes[h] == i:
                        for axis in range(3):
                            share = rows.weight[k, q] * rows.impulse[k] * rows.direction[k, axis]
                            tally.held_impulse[network.held_group[h], axis] -= share


@lean
def longest_way(tips, step):
    """Of any tip in the step [m]."""
    longest = 0.0
    for p in range(tips.end.shape[1]):
        square = 0.0
        for axis in range(3):
            square += (tips.end[step, p, axis] - tips.start[step, p, axis]) ** 2
        longest = max(longest, math.sqrt(square))
    return longest


@lean
def meet_probes(network, motion, drive, step, probes, lam, mobility):
    """Contact with thin probes, once lam and the other contacts of the step are known; the pressure beside it [Pa].

    `mobility` is G·W̃·G [m⁴/kg]; 0 where no volume is kept (eq. 141–147).
    """
    dt = drive.dt
    stage = Stage(network, motion, drive.tips, probes, step, dt)
    plain = dt * fastest_node(network, motion, lam, dt) + longest_way(drive.tips, step)
    if not plain < math.inf:
        return lam
    lightest = network.largest_inverse_mass
    reach, horizon, beside, crosses = plain, ROOM * plain, lam, False
    find_near(network, motion, drive.tips, step, probes, horizon)
    gather(stage, lam)
    probes.rows.count[0] = 0
    for sweep in range(PASSES):
        found, crosses = search(stage)
        if found == 0 or sweep + 1 == PASSES:
            break
        beside, faster = solve_rows(stage, lam, mobility)
        probes.counts[1] += 1
        reach = plain + dt * faster + pressure_reach(beside - lam, mobility, lightest, dt)
        if reach > horizon:
            horizon = ROOM * reach
            find_near(network, motion, drive.tips, step, probes, horizon)
            gather(stage, lam)
        move(stage, beside - lam)
    probes.counts[0] += probes.rows.count[0] > 0
    if crosses:
        beside, reach = carry(stage, lam, mobility, plain, horizon)
    elif probes.rows.count[0] > 0:
        settle(stage)
    probes.travel[0] += reach
    return beside
