"""Forces of obstacles on points inside quadratic facets, by impulses that leave nothing inside at the end of the step.

0 ≤ f ⟂ g ≥ 0 with the gap g that the step would end with, solved for point after point from the forces of the last
step (projected Gauss–Seidel; Moreau 1988, Jourdan, Alart, Jean 1998; theory, eq. 9.3–9.5). Friction acts the same way
along the facet.
"""

import math

from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.points.facets import LEFT, add_at_point, at_point, begin_touch, force_at, forget, list_near

SWEEPS = 40
"""Most sweeps per step."""
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
    drag, normal = facets.dragging, facets.normal
    t0, t1, t2 = drag[f, q, 0] - k * slip[0], drag[f, q, 1] - k * slip[1], drag[f, q, 2] - k * slip[2]
    inward = t0 * normal[f, q, 0] + t1 * normal[f, q, 1] + t2 * normal[f, q, 2]
    t0, t1, t2 = t0 - inward * normal[f, q, 0], t1 - inward * normal[f, q, 1], t2 - inward * normal[f, q, 2]
    size = math.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
    if size > most:
        part = most / size
        t0, t1, t2 = part * t0, part * t1, part * t2
    drag[f, q, 0], drag[f, q, 1], drag[f, q, 2] = t0, t1, t2


@njit_inlined
def slides(facets, boundary, o, f, q):
    """Whether the friction force is at its limit, so that the point slides and its anchor moves to where the step
    ends."""
    if not boundary.friction[o] > 0.0:
        return False
    drag, most = facets.dragging, boundary.friction[o] * facets.pressing[f, q]
    square = drag[f, q, 0] ** 2 + drag[f, q, 1] ** 2 + drag[f, q, 2] ** 2
    return square >= NEARLY * most * most


@njit_inlined
def press(facets, boundary, step, f, q):
    """Corrects the force on point q of facet f so that the point, with velocity `point_speed`, ends the step
    outside."""
    u, dt, o = facets.point_speed, boundary.dt, facets.candidate[f, q] - 1
    slope = facets.slope
    gap = facets.gap[f, q] + dt * (slope[f, q, 0] * u[q, 0] + slope[f, q, 1] * u[q, 1] + slope[f, q, 2] * u[q, 2])
    k = facets.mass[f, q] / (dt * dt)
    force = facets.pressing[f, q] - RELAXATION * k * gap
    if not force > 0.0:
        facets.pressing[f, q] = 0.0
        for axis in range(3):
            facets.dragging[f, q, axis] = 0.0
        return
    start = facets.start[f, q]
    if facets.contact_id[f, q] == 0:
        begin_touch(facets, boundary, step, (start[0], start[1], start[2]), o, (f, q))
    facets.pressing[f, q] = force
    if boundary.friction[o] > 0.0:
        c, v, a = boundary.position[step, o], boundary.velocity[step, o], facets.anchor[f, q]
        s0, s1, s2 = start[0] - c[0] - a[0], start[1] - c[1] - a[1], start[2] - c[2] - a[2]
        slip = (
            s0 + dt * u[q, 0] - LEFT * (s0 + dt * v[0]),
            s1 + dt * u[q, 1] - LEFT * (s1 + dt * v[1]),
            s2 + dt * u[q, 2] - LEFT * (s2 + dt * v[2]),
        )
        rub(facets, f, q, k, boundary.friction[o] * force, slip)


@njit_inlined
def settle_points(facets, boundary, step, f):
    """Applies `press` to the points of facet f in turn; their changes of force go into `change` (p, 3) [N]. Returns the
    largest change and the largest force [N]."""
    dt, u, change, points = boundary.dt, facets.point_speed, facets.change, facets.shape.shape[0]
    changed, largest = 0.0, 0.0
    for q in range(points):
        if facets.candidate[f, q] == 0:
            continue
        k0, k1, k2 = force_at(facets, f, q)
        press(facets, boundary, step, f, q)
        f0, f1, f2 = force_at(facets, f, q)
        d0, d1, d2 = f0 - k0, f1 - k1, f2 - k2
        largest = max(largest, abs(f0) + abs(f1) + abs(f2))
        if d0 == 0.0 and d1 == 0.0 and d2 == 0.0:
            continue
        changed = max(changed, abs(d0) + abs(d1) + abs(d2))
        change[q, 0], change[q, 1], change[q, 2] = d0, d1, d2
        for p in range(points):
            pull = dt * facets.coupling[f, q, p]
            u[p, 0], u[p, 1], u[p, 2] = u[p, 0] + pull * d0, u[p, 1] + pull * d1, u[p, 2] + pull * d2
    return changed, largest


@njit_inlined
def open_facet(facets, speed, f):
    """Sets `point_speed` of the points of facet f [m/s], and their changes to 0."""
    u, change = facets.point_speed, facets.change
    for q in range(facets.shape.shape[0]):
        u[q, 0], u[q, 1], u[q, 2] = at_point(speed, facets.node, facets.shape[q], f)
        change[q, 0], change[q, 1], change[q, 2] = 0.0, 0.0, 0.0


@njit_inlined
def tell_nodes(facets, speed, inverse_mass, dt, f):
    """Adds the effect of the changes of force on facet f to the velocities `speed` of its nodes [m/s]."""
    change = facets.change
    for a in range(6):
        i, d0, d1, d2 = facets.node[f, a], 0.0, 0.0, 0.0
        for q in range(facets.shape.shape[0]):
            share = facets.shape[q, a]
            d0, d1, d2 = d0 + share * change[q, 0], d1 + share * change[q, 1], d2 + share * change[q, 2]
        w = dt * inverse_mass[i]
        speed[i, 0], speed[i, 1], speed[i, 2] = speed[i, 0] + w * d0, speed[i, 1] + w * d1, speed[i, 2] + w * d2


@njit_inlined
def give_back(facets, speed, inverse_mass, dt, count):
    """For the first `count` facets in `near`, removes from `speed` the previous forces at points that have left their
    obstacle."""
    for k in range(count):
        f = facets.near[k]
        for q in range(facets.shape.shape[0]):
            now = force_at(facets, f, q)
            for axis in range(3):
                facets.change[q, axis] = now[axis] - facets.last_force[f, q, axis]
        tell_nodes(facets, speed, inverse_mass, dt, f)


@njit_inlined
def book(facets, boundary, step, speed, contact_impulse, f, q):
    """Adds the impulse on point q of facet f to its obstacle, and moves the anchor of a point that slides."""
    dt, o = boundary.dt, facets.contact_id[f, q] - 1
    f0, f1, f2 = force_at(facets, f, q)
    contact_impulse[o, 0] += dt * f0
    contact_impulse[o, 1] += dt * f1
    contact_impulse[o, 2] += dt * f2
    if f0 == 0.0 and f1 == 0.0 and f2 == 0.0:
        forget(facets, f, q)
    elif slides(facets, boundary, o, f, q):
        y, u = facets.start[f, q], at_point(speed, facets.node, facets.shape[q], f)
        for axis in range(3):
            facets.anchor[f, q, axis] = y[axis] + dt * u[axis] - boundary.position[step, o, axis]


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
def corrections_into(nodes, facets, boundary, step, speed, field, inverse_mass, contact_impulse):
    """The changes of the forces at all points, as nodal forces [N], into `field` (n, 3). Adds the impulses of the
    obstacles.

    `speed` (n, 4): velocities of the nodes under the forces of the last step [m/s]; each correction updates it for the
    following facets.
    """
    field[:] = 0.0
    count, lost = list_near(facets, nodes, boundary, step, speed)
    if lost >= 0:
        give_back(facets, speed, inverse_mass, boundary.dt, count)
    sweep_until_settled(facets, boundary, step, speed, inverse_mass, count)
    for k in range(count):
        f = facets.near[k]
        for q in range(facets.shape.shape[0]):
            f0, f1, f2 = force_at(facets, f, q)
            last = facets.last_force[f, q]
            add_at_point(facets, field, (f0 - last[0], f1 - last[1], f2 - last[2]), f, q)
            if facets.contact_id[f, q] > 0:
                book(facets, boundary, step, speed, contact_impulse, f, q)
