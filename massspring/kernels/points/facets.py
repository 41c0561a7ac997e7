"""Contact of points inside quadratic facets with obstacles: which points may touch in a step, where, and with which
force.

A uniform pressure on a quadratic facet gives no force at its corners, so contact at nodes alone is uneven. Here forces
act at points inside the facet (theory, eq. 9.3–9.5); `facet_forces` computes them.
A facet that is long against a round obstacle gets further points where this is deepest: between the fixed ones it would
slip through.
"""

import math

from massspring.kernels.contact.gaps import gap_and_normal
from massspring.kernels.contact.nearest import box_square, nearest_of_facet, shape_at
from massspring.kernels.contact.node_contact import after_contact
from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.vec3 import add_to, dot, minus, over, plus, put, row, times

LEFT = 0.95
"""Share of a penetration or slip at the start of a step that may remain at its end. Pressures respond one step later,
so a full correction at once would shake the body (eq. 9.7)."""


FURTHER = 4
"""Most further points of a facet."""
THIN = 1.0
"""Radius of an obstacle over half the longest side of a facet below which the facet gets further points: at 1 a sphere
sinks in between its fixed ones by up to 3 % of its radius."""
DEEPER = 0.2
"""Of the radius: how much deeper than all that touch an obstacle a further point must be."""
LOOSE = 0.1
"""Least mobility of a further point over the largest of the others: next to what is held nothing can answer a force."""


@njit_inlined
def at_point(table, node, weights, f):
    """Σ_a N_a u_a of `table` (n, 3) at a point of facet f with shape functions `weights` (6,)."""
    u = (0.0, 0.0, 0.0)
    for a in range(6):
        u = plus(u, times(weights[a], row(table, node[f, a])))
    return u


@njit_inlined
def is_far(facets, nodes, boundary, step, f):
    """Whether no point of facet f can touch an obstacle in this step."""
    x, node, place = nodes.x, facets.node, boundary.position[step]
    middle = over(plus(plus(row(x, node[f, 0]), row(x, node[f, 1])), row(x, node[f, 2])), 3.0)
    for o in range(boundary.radius.shape[0]):
        if boundary.inside[o] and not gap_and_normal(boundary, o, minus(middle, row(place, o)))[0] > facets.reach[f]:
            return False
    return True


@njit_inlined
def deepest(boundary, step, y):
    """The obstacle with the smallest gap at the point y, that gap [m], and its gradient."""
    best, least, normal, place = 0, math.inf, (0.0, 0.0, 0.0), boundary.position[step]
    for o in range(boundary.radius.shape[0]):
        if not boundary.inside[o]:
            continue
        gap, n = gap_and_normal(boundary, o, minus(y, row(place, o)))
        if gap < least:
            best, least, normal = o, gap, n
    return best, least, normal


@njit_inlined
def forget(facets, f, q):
    """Ends the contact at point q of facet f and clears its forces."""
    facets.contact_id[f, q], facets.pressing[f, q] = 0, 0.0
    put(facets.dragging[f], q, (0.0, 0.0, 0.0))


@njit_inlined
def force_at(facets, f, q):
    """The force on point q of facet f [N]; 0 where nothing is touched."""
    return plus(times(facets.pressing[f, q], row(facets.normal[f], q)), row(facets.dragging[f], q))


@njit_inlined
def face(facets, boundary, step, y, o, place):
    """Sets the normal of point `place` (f, q) to that of obstacle o at y [m], the position at the start of the step.
    With the predicted position a round obstacle would do work on a point that slides. Returns the gap at the start of
    the step if it is negative, else 0 [m]."""
    f, q = place
    r = minus(y, row(boundary.position[step], o))
    put(facets.normal[f], q, gap_and_normal(boundary, o, r)[1])
    before = plus(r, times(boundary.dt, row(boundary.velocity[step], o)))
    return min(gap_and_normal(boundary, o, before)[0], 0.0)


@njit_inlined
def begin_touch(facets, boundary, step, y, o, place):
    """Point `place` (f, q) at y [m] touches obstacle o from this step on; friction holds it where it is."""
    f, q = place
    facets.contact_id[f, q] = o + 1
    v = row(boundary.velocity[step], o)
    put(facets.anchor[f], q, minus(y, minus(row(boundary.position[step], o), times(boundary.dt, v))))


@njit_inlined
def add_at_point(facets, field, force, f, q):
    """Distributes a force (3,) [N] at point q of facet f to its nodes, into `field` (n, 3)."""
    for a in range(6):
        add_to(field, facets.node[f, a], times(facets.shape[f, q, a], force))


@njit_inlined
def depth_at(facets, nodes, boundary, o, centre, f, q):
    """How deep point q of facet f lies in obstacle o with its anchor at `centre` [m]."""
    y = at_point(nodes.x, facets.node, facets.shape[f, q], f)
    return -gap_and_normal(boundary, o, minus(y, centre))[0]


@njit_inlined
def bare_point(facets, nodes, boundary, step, f):
    """Whether a facet needs one more point, and the barycentric coordinates of its place: where an obstacle that is
    thin against the facet, and within its reach, is deepest, unless it is hardly deeper than at a point that touches
    it."""
    place, deepest_yet, found, at = boundary.position[step], -facets.reach[f], False, (0.0, 0.0, 0.0)
    for o in range(boundary.radius.shape[0]):
        radius, centre, span = boundary.radius[o], row(place, o), row(boundary.span, o)
        if not boundary.inside[o] or boundary.is_plane[o] or not radius < THIN * facets.half_side[f]:
            continue
        if not box_square(nodes.x, facets.node, f, centre, span) < (radius - deepest_yet) ** 2:
            continue
        square, b = nearest_of_facet(nodes.x, facets.node, f, centre, span)
        depth, held = radius - math.sqrt(square), -math.inf
        for q in range(facets.count[f]):
            if facets.contact_id[f, q] == o + 1:
                held = max(held, depth_at(facets, nodes, boundary, o, centre, f, q))
        if depth > deepest_yet and depth > held + DEEPER * radius:
            deepest_yet, found, at = depth, True, b
    return found, at


@njit_inlined
def drop_idle(facets, f):
    """Forgets further points of facet f that touch nothing."""
    fixed, q = facets.shape.shape[1] - FURTHER, facets.count[f] - 1
    while q >= fixed:
        if facets.contact_id[f, q] == 0:
            last = facets.count[f] - 1
            facets.contact_id[f, q], facets.pressing[f, q] = facets.contact_id[f, last], facets.pressing[f, last]
            put(facets.normal[f], q, row(facets.normal[f], last))
            put(facets.dragging[f], q, row(facets.dragging[f], last))
            put(facets.anchor[f], q, row(facets.anchor[f], last))
            for a in range(6):
                facets.shape[f, q, a] = facets.shape[f, last, a]
            forget(facets, f, last)
            facets.count[f] = last
        q -= 1


@njit_inlined
def couple(facets, inverse_mass, f, q):
    """Sets what forces at point q of facet f and at the points before it do to each other. Returns whether point q can
    move."""
    most = 0.0
    for p in range(q + 1):
        shared = 0.0
        for a in range(6):
            shared += facets.shape[f, q, a] * facets.shape[f, p, a] * inverse_mass[facets.node[f, a]]
        facets.coupling[f, q, p] = facets.coupling[f, p, q] = shared
        if p < q:
            most = max(most, facets.coupling[f, p, p])
    facets.mass[f, q] = 1.0 / facets.coupling[f, q, q]
    return facets.coupling[f, q, q] > LOOSE * most


@njit_lean
def place_further_points(nodes, facets, boundary, step, inverse_mass):
    """Gives facets further points where obstacles thin against them are deeper than at all that touch them. Such a
    point stays where it is while it touches. Facets without any keep their fixed points alone."""
    fixed = facets.shape.shape[1] - FURTHER
    for f in range(facets.node.shape[0]):
        if facets.count[f] > fixed:
            drop_idle(facets, f)
            for q in range(fixed, facets.count[f]):
                couple(facets, inverse_mass, f, q)
        if facets.count[f] == facets.shape.shape[1]:
            continue
        found, b = bare_point(facets, nodes, boundary, step, f)
        if found:
            q, weights = facets.count[f], shape_at(b)
            for a in range(6):
                facets.shape[f, q, a] = weights[a]
            if couple(facets, inverse_mass, f, q):
                facets.count[f] = q + 1


@njit_inlined
def push_at_point(frame, rows, implicit, force, f, q):
    """A force (3,) [N] at point q of facet f: v* += dt W f of its nodes, and the force on those that are held. With
    implicit springs into `field`, since each force moves all nodes."""
    facets, nodes, weights, dt = rows.facets, frame.nodes, frame.model.inverse_mass, frame.boundary.dt
    if implicit is not None:
        add_at_point(facets, rows.field, force, f, q)
        return
    for a in range(6):
        i, part = facets.node[f, a], times(facets.shape[f, q, a], force)
        add_to(nodes.v_star, i, times(dt * weights[i], part))
        add_to(nodes.force, i, part)


@njit_lean
def push_again(frame, rows, step, implicit):
    """Applies the contact forces of the last step, along the current normals."""
    facets, boundary = rows.facets, frame.boundary
    for f in range(facets.node.shape[0]):
        for q in range(facets.count[f]):
            if facets.contact_id[f, q] > 0:
                y = at_point(frame.nodes.x, facets.node, facets.shape[f, q], f)
                face(facets, boundary, step, y, facets.contact_id[f, q] - 1, (f, q))
                push_at_point(frame, rows, implicit, force_at(facets, f, q), f, q)


@njit_inlined
def name_speeds(frame, rows, f):
    """ṽ [m/s] of the nodes of facet f into `node_vector` (eq. 3.4)."""
    for a in range(6):
        i = rows.facets.node[f, a]
        put(rows.node_vector, i, after_contact(frame.contacts, i, row(frame.nodes.v_star, i)))


@njit_inlined
def prepare_point(facets, boundary, step, state, f, q):
    """Prepares the contact of point q of facet f; `state` is its position and its velocity under the forces of the last
    step.

    From here on the gap is linear in the velocity. Returns whether the point has lost contact with another obstacle
    that pressed on it.
    """
    y, u = state
    dt, left = boundary.dt, False
    o, gap, n = deepest(boundary, step, plus(y, times(dt, u)))
    may_touch = gap < facets.reach[f] or facets.contact_id[f, q] == o + 1
    facets.candidate[f, q] = o + 1 if may_touch else 0
    put(facets.last_force[f], q, force_at(facets, f, q))
    put(facets.start[f], q, y)
    if facets.contact_id[f, q] not in (0, o + 1):
        left = facets.pressing[f, q] > 0.0
        forget(facets, f, q)
    put(facets.slope[f], q, n)
    depth = face(facets, boundary, step, y, o, (f, q))
    facets.gap[f, q] = gap - dt * dot(n, u) - LEFT * depth
    if gap < 0.0 and facets.contact_id[f, q] == 0:
        begin_touch(facets, boundary, step, y, o, (f, q))
    return left


@njit_inlined
def list_near(frame, rows, step):
    """Lists in `near`, and prepares, the facets that touch an obstacle or may touch one in this step. Returns their
    number, and the last facet that lost a contact, or −1."""
    facets, nodes, boundary, count, lost = rows.facets, frame.nodes, frame.boundary, 0, -1
    for f in range(facets.node.shape[0]):
        # A thin obstacle stretches a facet beyond its reach.
        near = facets.count[f] > facets.shape.shape[1] - FURTHER or not is_far(facets, nodes, boundary, step, f)
        for q in range(facets.count[f]):
            near |= facets.contact_id[f, q] > 0
        if near:
            facets.near[count] = f
            count += 1
            name_speeds(frame, rows, f)
            for q in range(facets.count[f]):
                weights = facets.shape[f, q]
                state = at_point(nodes.x, facets.node, weights, f), at_point(rows.node_vector, facets.node, weights, f)
                if prepare_point(facets, boundary, step, state, f, q):
                    lost = f
    return count, lost
