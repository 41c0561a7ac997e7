"""Forces of obstacles on points inside quadratic facets, by impulses that leave nothing inside at the end of the step.

0 ≤ f ⟂ g ≥ 0 with the gap g that the step would end with, solved for point after point from the forces of the last
step (projected Gauss–Seidel; Moreau 1988, Jourdan, Alart, Jean 1998; theory, eq. 9.3–9.5). Friction acts the same way
along the facet.
"""

import math

from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.vec3 import add_to, dot, minus, plus, put, row, times
from massspring.kernels.points.facets import (
    LEFT,
    at_point,
    begin_touch,
    force_at,
    forget,
    list_near,
    name_speeds,
    push_at_point,
)

SWEEPS = 40
"""Most sweeps per step. Under a plane inside facets, as with semi_implicit, all are used; 10 move the force by 2e-5
only, but a free ball then drifts."""
RELAXATION = 1.5
"""Factor on each correction (successive over-relaxation); it takes a quarter fewer sweeps than 1."""
NEARLY = 1.0 - 1e-9
"""Share of the squared friction limit from which on a force counts as being at the limit: allows for round-off."""
SETTLED = 1e-4
"""Largest change of a force in a sweep, over the largest force, at which the sweeps end; 1e-3 would shake a body at
rest."""


@njit_inlined
def rub(facets, f, q, k, most, slip):
    """Corrects the friction force so that it pulls the point towards its anchor; Coulomb's law limits it to `most` [N].

    `slip` (3,) [m]: the displacement to undo; a stiffness of `k` [N/m] undoes all of it within the step.
    """
    drag, n = facets.dragging[f], row(facets.normal[f], q)
    t = minus(row(drag, q), times(k, slip))
    t = minus(t, times(dot(t, n), n))
    size = math.sqrt(dot(t, t))
    if size > most:
        t = times(most / size, t)
    put(drag, q, t)


@njit_inlined
def slides(facets, boundary, o, f, q):
    """Whether the friction force is at its limit, so that the point slides and its anchor moves to where the step
    ends."""
    if not boundary.friction[o] > 0.0:
        return False
    drag, most = row(facets.dragging[f], q), boundary.friction[o] * facets.pressing[f, q]
    return dot(drag, drag) >= NEARLY * most * most


@njit_inlined
def press(facets, boundary, step, f, q):
    """Corrects the force on point q of facet f so that the point, with velocity `point_speed`, ends the step
    outside."""
    u, dt, o = row(facets.point_speed, q), boundary.dt, facets.candidate[f, q] - 1
    gap = facets.gap[f, q] + dt * dot(row(facets.slope[f], q), u)
    k = facets.mass[f, q] / (dt * dt)
    force = facets.pressing[f, q] - RELAXATION * k * gap
    if not force > 0.0:
        facets.pressing[f, q] = 0.0
        put(facets.dragging[f], q, (0.0, 0.0, 0.0))
        return
    start = row(facets.start[f], q)
    if facets.contact_id[f, q] == 0:
        begin_touch(facets, boundary, step, start, o, (f, q))
    facets.pressing[f, q] = force
    if boundary.friction[o] > 0.0:
        v = row(boundary.velocity[step], o)
        s = minus(minus(start, row(boundary.position[step], o)), row(facets.anchor[f], q))
        slip = minus(plus(s, times(dt, u)), times(LEFT, plus(s, times(dt, v))))
        rub(facets, f, q, k, boundary.friction[o] * force, slip)


@njit_inlined
def settle_points(facets, boundary, step, f):
    """Applies `press` to the points of facet f in turn; their changes of force go into `change` (p, 3) [N]. Returns the
    largest change and the largest force [N]."""
    dt, u, points = boundary.dt, facets.point_speed, facets.count[f]
    changed, largest = 0.0, 0.0
    for q in range(points):
        if facets.candidate[f, q] == 0:
            continue
        before = force_at(facets, f, q)
        press(facets, boundary, step, f, q)
        now = force_at(facets, f, q)
        d = minus(now, before)
        largest = max(largest, abs(now[0]) + abs(now[1]) + abs(now[2]))
        if d[0] == 0.0 and d[1] == 0.0 and d[2] == 0.0:
            continue
        changed = max(changed, abs(d[0]) + abs(d[1]) + abs(d[2]))
        put(facets.change, q, d)
        for p in range(points):
            add_to(u, p, times(dt * facets.coupling[f, q, p], d))
    return changed, largest


@njit_inlined
def open_facet(facets, speed, f):
    """Sets `point_speed` of the points of facet f [m/s], and their changes to 0."""
    for q in range(facets.count[f]):
        put(facets.point_speed, q, at_point(speed, facets.node, facets.shape[f, q], f))
        put(facets.change, q, (0.0, 0.0, 0.0))


@njit_inlined
def tell_nodes(facets, speed, inverse_mass, dt, f):
    """Adds the effect of the changes of force on facet f to the velocities `speed` of its nodes [m/s]."""
    for a in range(6):
        i, d = facets.node[f, a], (0.0, 0.0, 0.0)
        for q in range(facets.count[f]):
            d = plus(d, times(facets.shape[f, q, a], row(facets.change, q)))
        add_to(speed, i, times(dt * inverse_mass[i], d))


@njit_inlined
def give_back(facets, speed, inverse_mass, dt, count):
    """For the first `count` facets in `near`, removes from `speed` the previous forces at points that have left their
    obstacle."""
    for k in range(count):
        f = facets.near[k]
        for q in range(facets.count[f]):
            put(facets.change, q, minus(force_at(facets, f, q), row(facets.last_force[f], q)))
        tell_nodes(facets, speed, inverse_mass, dt, f)


@njit_inlined
def book(facets, boundary, step, speed, contact_impulse, f, q):
    """Adds the impulse on point q of facet f to its obstacle, and moves the anchor of a point that slides."""
    dt, o, force = boundary.dt, facets.contact_id[f, q] - 1, force_at(facets, f, q)
    add_to(contact_impulse, o, times(dt, force))
    if force[0] == 0.0 and force[1] == 0.0 and force[2] == 0.0:
        forget(facets, f, q)
    elif slides(facets, boundary, o, f, q):
        end = plus(row(facets.start[f], q), times(dt, at_point(speed, facets.node, facets.shape[f, q], f)))
        put(facets.anchor[f], q, minus(end, row(boundary.position[step], o)))


@njit_inlined
def sweep(facets, boundary, step, speed, inverse_mass, count, pressed_only):
    """One sweep over the first `count` facets in `near`, or only over those with a force. Returns the largest change of
    a force and the largest force [N]."""
    changed, largest = 0.0, 0.0
    for k in range(count):
        f = facets.near[k]
        if pressed_only and not facets.pressed[f]:
            continue
        open_facet(facets, speed, f)
        moved, most = settle_points(facets, boundary, step, f)
        if moved > 0.0:
            tell_nodes(facets, speed, inverse_mass, boundary.dt, f)
        facets.pressed[f] = moved > 0.0 or most > 0.0
        changed, largest = max(changed, moved), max(largest, most)
    return changed, largest


@njit_inlined
def sweep_until_settled(facets, boundary, step, speed, inverse_mass, count):
    """The first and the last sweeps go over all facets, those between over facets with a force."""
    for number in range(SWEEPS):
        among_pressed = number > 0 and number + 1 < SWEEPS
        changed, largest = sweep(facets, boundary, step, speed, inverse_mass, count, among_pressed)
        if not changed > SETTLED * largest:
            if not among_pressed:
                break
            changed, largest = sweep(facets, boundary, step, speed, inverse_mass, count, False)
            if not changed > SETTLED * largest:
                break


@njit_lean
def correct_forces(frame, rows, step, implicit):
    """Solves for the forces at all points, and applies their changes. Returns how many facets are near an obstacle.

    `node_vector` holds the velocities of their nodes; each correction updates it for the following facets.
    """
    facets, boundary, speed, weights = rows.facets, frame.boundary, rows.node_vector, frame.model.inverse_mass
    count, lost = list_near(frame, rows, step)
    if lost >= 0:
        give_back(facets, speed, weights, boundary.dt, count)
    sweep_until_settled(facets, boundary, step, speed, weights, count)
    for k in range(count):
        f = facets.near[k]
        for q in range(facets.count[f]):
            change = minus(force_at(facets, f, q), row(facets.last_force[f], q))
            push_at_point(frame, rows, implicit, change, f, q)
    return count


@njit_lean
def book_points(frame, rows, step, count):
    """Adds the impulses on the points of the first `count` facets in `near` to their obstacles, and moves the anchors
    of points that slide, with the velocities at the end of the step."""
    facets, impulse = rows.facets, frame.diagnostics.contact_impulse
    for k in range(count):
        f = facets.near[k]
        if frame.boundary.rough:  # only a point that slides needs them
            name_speeds(frame, rows, f)
        for q in range(facets.count[f]):
            if facets.contact_id[f, q] > 0:
                book(facets, frame.boundary, step, rows.node_vector, impulse, f, q)
