"""Which surface nodes lie on which obstacles during this step.

The rare cases (friction, a node on two obstacles) have separate loops in `kernels.contact.friction`, once per step.
"""

import math

from massspring.kernels.contact.friction import (
    activate_edges,
    apply_friction,
    is_held_down,
    onto_edge,
    release_edges,
    release_slipping,
)
from massspring.kernels.contact.gaps import gap_and_normal, predicted_gaps_into, pushed_velocity
from massspring.kernels.contact.node_contact import FREE, ON_EDGE, SLIDES, round_contact
from massspring.kernels.jit.decorators import njit_exposed, njit_inlined, njit_lean
from massspring.kernels.jit.flat import BLOCK, any_gap_within
from massspring.kernels.jit.vec3 import cross, dot, minus, plus, put, row, times

CONTACT_PASSES = 3
"""Active-set passes a step: one when nothing changes; lam is always solved for the set that is applied."""


@njit_lean
def activate(model, nodes, contacts, boundary, step, push, count):
    """Puts the first `count` nodes of `contacts.entering` on the obstacle each would enter deepest (eq. 3.7).

    `v_target` = n a, a = n·(target − x)/dt, ends the step on the obstacle. A round one pushes along n = (x − c)/|x − c|
    of the position now, not of the prediction: that would do work on a node that slides, and pump its oscillations up.
    """
    dt, place = boundary.dt, boundary.position[step]
    for k in range(count):
        i = contacts.entering[k]
        u, deepest = pushed_velocity(model, nodes, boundary, push, i), 0.0
        for o in range(boundary.radius.shape[0]):
            if boundary.inside[o]:
                continue
            s = minus(row(nodes.x, i), row(place, o))
            r = plus(s, times(dt, u))
            depth, n = gap_and_normal(boundary, o, r)
            if depth < deepest:
                deepest, lift = depth, -depth
                if not boundary.is_plane[o]:
                    n, lift = round_contact(s, r, row(boundary.span, o), boundary.radius[o])
                a = dot(n, u) + lift / dt
                contacts.contact_id[i], contacts.mode[i] = o + 1, SLIDES
                put(contacts.normal, i, n)
                put(contacts.direction, i, n)
                put(contacts.v_target, i, times(a, n))


@njit_exposed
def release_all(contacts):
    """No node is touched."""
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        contacts.contact_id[i], contacts.mode[i] = 0, FREE
    contacts.active_count[0] = 0


@njit_inlined
def register(contacts, count):
    """Appends the activated ones among the first `count` nodes of `entering` to `active`, and sets their gap to
    infinity."""
    active, entering, mode = contacts.active, contacts.entering, contacts.mode
    listed = contacts.active_count[0]
    for k in range(count):
        i = entering[k]
        if mode[i] > FREE:
            active[listed] = i
            contacts.predicted_gap[i] = math.inf
            listed += 1
    contacts.active_count[0] = listed


@njit_inlined
def forget_released(contacts):
    """Removes released nodes from `active`, so that a node that touches again is listed once."""
    active, mode, kept = contacts.active, contacts.mode, 0
    for k in range(contacts.active_count[0]):
        i = active[k]
        if mode[i] > FREE:
            active[kept] = i
            kept += 1
    contacts.active_count[0] = kept


@njit_exposed
def find_contacts(model, nodes, contacts, boundary, step, push):
    """Finds the touched nodes of the step, with the push f of the last step acting on them: u = v* + dt W f (eq.
    3.7)."""
    corners = note_corners(contacts, boundary)
    release_all(contacts)
    predicted_gaps_into(model, nodes, contacts, boundary, step, push)
    enter(model, nodes, contacts, boundary, step, push, corners)


@njit_inlined
def note_corners(contacts, boundary):
    """Notes the corners of facets that lie on planes; returns how many."""
    count, start = 0, contacts.beside_start
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if contacts.mode[i] == FREE or start[i + 1] == start[i]:
            continue
        o, second = contacts.contact_id[i], contacts.second[i] if contacts.mode[i] == ON_EDGE else 0
        if boundary.is_plane[o - 1] and (second == 0 or boundary.is_plane[second - 1]):
            contacts.stayed[count, 0], contacts.stayed[count, 1], contacts.stayed[count, 2] = i, o, second
            count += 1
    return count


@njit_inlined
def keep_corners(model, nodes, contacts, boundary, step, push, count):
    """Puts the first `count` corners in `stayed` back on their planes: nothing need press them (eq. 3.8b)."""
    place, dt, listed = boundary.position[step], boundary.dt, contacts.active_count[0]
    for k in range(count):
        i, o, second = contacts.stayed[k, 0], contacts.stayed[k, 1], contacts.stayed[k, 2]
        if contacts.mode[i] == FREE:
            contacts.predicted_gap[i] = math.inf
            contacts.active[listed] = i
            listed += 1
        elif second == 0:
            continue
        u = pushed_velocity(model, nodes, boundary, push, i)
        y = plus(row(nodes.x, i), times(dt, u))
        gap, n = gap_and_normal(boundary, o - 1, minus(y, row(place, o - 1)))
        a = dot(n, u) - gap / dt
        contacts.contact_id[i], contacts.mode[i] = o, SLIDES
        put(contacts.normal, i, n)
        put(contacts.direction, i, n)
        put(contacts.v_target, i, times(a, n))
        if second > 0:
            gap, m = gap_and_normal(boundary, second - 1, minus(y, row(place, second - 1)))
            contacts.second[i], contacts.mode[i] = second, ON_EDGE
            put(contacts.second_normal, i, m)
            onto_edge(contacts, i, a, dot(m, u) - gap / dt, cross(n, m))
    contacts.active_count[0] = listed


@njit_inlined
def enter(model, nodes, contacts, boundary, step, push, corners):
    """Activates the nodes whose predicted gap is negative (eq. 3.7), and the first `corners` in `stayed`."""
    touchable, predicted_gap, entering = model.touchable, contacts.predicted_gap, contacts.entering
    count = 0
    for begin in range(0, predicted_gap.shape[0], BLOCK):
        if not any_gap_within(predicted_gap, begin, 0.0):
            continue
        for i in range(begin, min(begin + BLOCK, predicted_gap.shape[0])):
            if predicted_gap[i] < 0.0 and touchable[i] > 0:
                entering[count] = i
                count += 1
    if count > 0:
        activate(model, nodes, contacts, boundary, step, push, count)
        register(contacts, count)
    if corners > 0:
        keep_corners(model, nodes, contacts, boundary, step, push, corners)
    if boundary.rough:
        apply_friction(model, nodes, contacts, boundary, step, push)
    if boundary.radius.shape[0] > 1:
        activate_edges(model, nodes, contacts, boundary, step, push)


@njit_inlined
def release_pulled(model, nodes, contacts, boundary, push):
    """Releases nodes that their only obstacle would pull (eq. 3.8); returns how many."""
    changes = 0
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if contacts.mode[i] == FREE or contacts.mode[i] == ON_EDGE:
            continue
        n, u = row(contacts.normal, i), pushed_velocity(model, nodes, boundary, push, i)
        pulled = dot(row(contacts.v_target, i), n) < dot(u, n)
        if pulled and not is_held_down(model, nodes, contacts, boundary, push, i, contacts.contact_id[i]):
            # The next pass checks a released node again, however the pressure changes.
            contacts.contact_id[i], contacts.mode[i], contacts.predicted_gap[i] = 0, FREE, 0.0
            changes += 1
    return changes


@njit_inlined
def enters(model, nodes, boundary, step, push, i):
    """Whether the free node i would end the step in an obstacle (eq. 3.7)."""
    y = plus(row(nodes.x, i), times(boundary.dt, pushed_velocity(model, nodes, boundary, push, i)))
    place = boundary.position[step]
    for o in range(boundary.radius.shape[0]):
        if not boundary.inside[o] and gap_and_normal(boundary, o, minus(y, row(place, o)))[0] < 0.0:
            return True
    return False


@njit_exposed
def revise_contacts(model, nodes, contacts, boundary, step, push, reach):
    """Releases nodes that an obstacle would pull, adds nodes that would enter one; the number of changes (eq. 3.8).

    `reach` [m] is how far the new pressure can have moved a node from where `predicted_gap` was measured: distances to
    obstacles change by no more, so a free node farther away need not be looked at.
    """
    touchable, predicted_gap, entering = model.touchable, contacts.predicted_gap, contacts.entering
    count, changes = 0, 0
    if boundary.rough:
        changes += release_slipping(model, nodes, contacts, boundary, push)
    if boundary.radius.shape[0] > 1:
        changes += release_edges(model, nodes, contacts, boundary, push) + activate_edges(
            model, nodes, contacts, boundary, step, push
        )
    for begin in range(0, predicted_gap.shape[0], BLOCK):
        if not any_gap_within(predicted_gap, begin, reach):
            continue
        for i in range(begin, min(begin + BLOCK, predicted_gap.shape[0])):
            if predicted_gap[i] > reach or contacts.mode[i] > FREE or touchable[i] == 0:
                continue
            if enters(model, nodes, boundary, step, push, i):
                entering[count] = i
                count += 1
    changes += release_pulled(model, nodes, contacts, boundary, push)
    if changes > 0:
        forget_released(contacts)
    if count > 0:
        activate(model, nodes, contacts, boundary, step, push, count)
        register(contacts, count)
    return changes + count


@njit_exposed
def pressure_reach(lam_change, mobility, lightest, dt):
    """dt² |Δlam| √(max w · Σ w |G|²) ≥ dt² |Δlam| w_i |G_i| [m]: how far a change of pressure moves any free node."""
    return 1.0001 * dt * dt * abs(lam_change) * math.sqrt(max(lightest * mobility, 0.0))
