"""Triangles that a thin tip crosses, or comes too near to, with the current contacts (docs/theory.md, section 11)."""

from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.vec3 import minus, plus, put, row, times
from massspring.kernels.probe.arrays import TESTED
from massspring.kernels.probe.contacts import row_of, set_row
from massspring.kernels.probe.continuous import NEVER, crossing, nearest_into, passes_by, point_to, stays_off, touching

SAME_TIME = 1e-6
"""Difference in time, over the step, within which crossings count as simultaneous: triangles that share the edge or
corner that is hit."""
ENOUGH = 0.95
"""Share of the radius from which on the direction of a contact is not updated: the missing distance is second order in
the step."""


@njit_lean
def pair_into(pair, x, velocity, triangles, f, dt):
    """Corners of a triangle relative to the tip of `pair`, at the start of the step and at its end [m]."""
    tip = row(pair.tip, 0)
    way = minus(row(pair.tip, 1), tip)
    for k in range(3):
        i = triangles[f, k]
        begin = minus(row(x, i), tip)
        put(pair.begin, k, begin)
        put(pair.end, k, plus(begin, minus(times(dt, row(velocity, i)), way)))


@njit_lean
def look(stage, p):
    """When and where the tip passes through each near triangle with the current contacts. Returns the first time, or
    NEVER."""
    probes, x, triangles, pair = stage.probes, stage.nodes.x, stage.probes.surface, stage.probes.pair
    put(pair.tip, 0, row(stage.tips.start[stage.step], p))
    put(pair.tip, 1, row(stage.tips.end[stage.step], p))
    first = NEVER
    for n in range(probes.near_count[p]):
        pair_into(pair, x, probes.velocity, triangles, probes.near[p, n], stage.dt)
        t = NEVER if passes_by(pair) else crossing(pair)
        probes.time[n] = t
        if t <= 1.0:
            first = min(first, t)
            for k in range(3):
                probes.passing[n, k], probes.passing[n, 3 + k] = pair.weight[k], pair.direction[k]
    probes.counts[TESTED] += probes.near_count[p]
    return first


@njit_lean
def add_crossings(probes, p, first):
    """Adds a contact for every triangle that the tip passes through at time `first`; returns how many found room.

    Later crossings do not count: the contacts found first stop the tip.
    """
    room = 0
    for n in range(probes.near_count[p]):
        if probes.time[n] <= first + SAME_TIME:
            for k in range(3):
                probes.pair.weight[k], probes.pair.direction[k] = probes.passing[n, k], probes.passing[n, 3 + k]
            room += set_row(probes.rows, p, probes.near[p, n], probes.surface, probes.pair)
    return room


@njit_lean
def add_touches(stage, p):
    """Adds a contact for every triangle that ends the step within the radius, at the point where it first touches;
    returns how many found room.

    A triangle that already has a contact, but turned under it, gets the direction at the end of the step.
    """
    room, probes, pair, triangles = 0, stage.probes, stage.probes.pair, stage.probes.surface
    for n in range(probes.near_count[p]):
        f = probes.near[p, n]
        pair_into(pair, stage.nodes.x, probes.velocity, triangles, f, stage.dt)
        if stays_off(pair.end, probes.radius[p]):
            continue
        distance = nearest_into(pair.end, pair.weight)
        if distance >= probes.radius[p]:
            continue
        if row_of(probes.rows, p, f) == probes.rows.count[0]:
            touching(pair, probes.radius[p])
        elif distance < ENOUGH * probes.radius[p]:
            point_to(pair, pair.end, distance)
        else:
            continue
        room += set_row(probes.rows, p, f, triangles, pair)
    return room


@njit_lean
def search(stage):
    """Adds contacts for all that the tips run into; returns (contacts that found room, whether a tip crosses)."""
    count, crosses = 0, False
    for p in range(stage.probes.radius.shape[0]):
        first = look(stage, p)
        if first <= 1.0:
            crosses = True
            count += add_crossings(stage.probes, p, first)
        else:
            count += add_touches(stage, p)
    return count, crosses
