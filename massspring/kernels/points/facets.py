"""Contact of points inside quadratic facets with obstacles: which points may touch in a step, where, and with which
force.

A uniform pressure on a quadratic facet gives no force at its corners, so contact at nodes alone is uneven. Here forces
act at points inside the facet (theory, eq. 9.3–9.5); `facet_forces` computes them.
"""

import math

from massspring.kernels.contact.gaps import gap_and_normal
from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.vec3 import add_to, dot, minus, over, plus, put, row, times

LEFT = 0.95
"""Share of a penetration or slip at the start of a step that may remain at its end. Pressures respond one step later,
so a full correction at once would shake the body (eq. 9.7)."""


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
        add_to(field, facets.node[f, a], times(facets.shape[q, a], force))


@njit_lean
def last_forces_into(nodes, facets, boundary, step, field):
    """The contact forces of the last step at all points, along the current normals, as nodal forces [N] into `field`
    (n, 3)."""
    field[:] = 0.0
    for f in range(facets.node.shape[0]):
        for q in range(facets.shape.shape[0]):
            if facets.contact_id[f, q] > 0:
                y = at_point(nodes.x, facets.node, facets.shape[q], f)
                face(facets, boundary, step, y, facets.contact_id[f, q] - 1, (f, q))
                add_at_point(facets, field, force_at(facets, f, q), f, q)


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
def list_near(facets, nodes, boundary, step, speed):
    """Lists in `near`, and prepares, the facets that touch an obstacle or may touch one in this step. Returns their
    number, and the last facet that lost a contact, or −1."""
    count, lost = 0, -1
    for f in range(facets.node.shape[0]):
        near = not is_far(facets, nodes, boundary, step, f)
        for q in range(facets.shape.shape[0]):
            near |= facets.contact_id[f, q] > 0
        if near:
            facets.near[count] = f
            count += 1
            for q in range(facets.shape.shape[0]):
                weights = facets.shape[q]
                state = at_point(nodes.x, facets.node, weights, f), at_point(speed, facets.node, weights, f)
                if prepare_point(facets, boundary, step, state, f, q):
                    lost = f
    return count, lost
