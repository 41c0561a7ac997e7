"""Contact of points inside quadratic facets with obstacles: which points may touch in a step, where, and with which
force.

A uniform pressure on a quadratic facet gives no force at its corners, so contact at nodes alone is uneven. Here forces
act at points inside the facet (theory, eq. 9.3–9.5); `facet_forces` computes them.
"""

import math

from massspring.kernels.contact.gaps import gap_and_normal
from massspring.kernels.jit.decorators import njit_inlined, njit_lean

LEFT = 0.95
"""Share of a penetration or slip at the start of a step that may remain at its end. Pressures respond one step later,
so a full correction at once would shake the body (eq. 9.7)."""


@njit_inlined
def at_point(table, node, weights, f):
    """Σ_a N_a u_a of `table` (n, 3) at a point of facet f with shape functions `weights` (6,)."""
    u0, u1, u2 = 0.0, 0.0, 0.0
    for a in range(6):
        i, share = node[f, a], weights[a]
        u0, u1, u2 = u0 + share * table[i, 0], u1 + share * table[i, 1], u2 + share * table[i, 2]
    return u0, u1, u2


@njit_inlined
def is_far(facets, nodes, boundary, step, f):
    """Whether no point of facet f can touch an obstacle in this step."""
    x, node = nodes.x, facets.node
    i, j, k = node[f, 0], node[f, 1], node[f, 2]
    c0, c1, c2 = x[i, 0] + x[j, 0] + x[k, 0], x[i, 1] + x[j, 1] + x[k, 1], x[i, 2] + x[j, 2] + x[k, 2]
    for o in range(boundary.radius.shape[0]):
        place = boundary.position[step, o]
        gap, _, _, _ = gap_and_normal(boundary, o, c0 / 3.0 - place[0], c1 / 3.0 - place[1], c2 / 3.0 - place[2])
        if not gap > facets.reach[f]:
            return False
    return True


@njit_inlined
def deepest(boundary, step, y):
    """The obstacle with the smallest gap at the point y, that gap [m], and its gradient."""
    best, least, n0, n1, n2 = 0, math.inf, 0.0, 0.0, 0.0
    for o in range(boundary.radius.shape[0]):
        place = boundary.position[step, o]
        gap, g0, g1, g2 = gap_and_normal(boundary, o, y[0] - place[0], y[1] - place[1], y[2] - place[2])
        if gap < least:
            best, least, n0, n1, n2 = o, gap, g0, g1, g2
    return best, least, n0, n1, n2


@njit_inlined
def forget(facets, f, q):
    """Ends the contact at point q of facet f and clears its forces."""
    facets.contact_id[f, q], facets.pressing[f, q] = 0, 0.0
    for axis in range(3):
        facets.dragging[f, q, axis] = 0.0


@njit_inlined
def force_at(facets, f, q):
    """The force on point q of facet f [N]; 0 where nothing is touched."""
    pressing, normal, drag = facets.pressing[f, q], facets.normal, facets.dragging
    return (
        pressing * normal[f, q, 0] + drag[f, q, 0],
        pressing * normal[f, q, 1] + drag[f, q, 1],
        pressing * normal[f, q, 2] + drag[f, q, 2],
    )


@njit_inlined
def face(facets, boundary, step, y, o, place):
    """Sets the normal of point `place` (f, q) to that of obstacle o at y [m], the position at the start of the step.
    With the predicted position a round obstacle would do work on a point that slides. Returns the gap at the start of
    the step if it is negative, else 0 [m]."""
    f, q = place
    centre, v, dt = boundary.position[step, o], boundary.velocity[step, o], boundary.dt
    r0, r1, r2 = y[0] - centre[0], y[1] - centre[1], y[2] - centre[2]
    _, n0, n1, n2 = gap_and_normal(boundary, o, r0, r1, r2)
    facets.normal[f, q, 0], facets.normal[f, q, 1], facets.normal[f, q, 2] = n0, n1, n2
    return min(gap_and_normal(boundary, o, r0 + dt * v[0], r1 + dt * v[1], r2 + dt * v[2])[0], 0.0)


@njit_inlined
def begin_touch(facets, boundary, step, y, o, place):
    """Point `place` (f, q) at y [m] touches obstacle o from this step on; friction holds it where it is."""
    f, q = place
    centre, v = boundary.position[step, o], boundary.velocity[step, o]
    facets.contact_id[f, q] = o + 1
    for axis in range(3):
        facets.anchor[f, q, axis] = y[axis] - (centre[axis] - boundary.dt * v[axis])


@njit_inlined
def add_at_point(facets, field, force, f, q):
    """Distributes a force (3,) [N] at point q of facet f to its nodes, into `field` (n, 3)."""
    for a in range(6):
        i, share = facets.node[f, a], facets.shape[q, a]
        for axis in range(3):
            field[i, axis] += share * force[axis]


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
    force = force_at(facets, f, q)
    o, gap, n0, n1, n2 = deepest(boundary, step, (y[0] + dt * u[0], y[1] + dt * u[1], y[2] + dt * u[2]))
    may_touch = gap < facets.reach[f] or facets.contact_id[f, q] == o + 1
    facets.candidate[f, q] = o + 1 if may_touch else 0
    for axis in range(3):
        facets.last_force[f, q, axis], facets.start[f, q, axis] = force[axis], y[axis]
    if facets.contact_id[f, q] not in (0, o + 1):
        left = facets.pressing[f, q] > 0.0
        forget(facets, f, q)
    facets.slope[f, q, 0], facets.slope[f, q, 1], facets.slope[f, q, 2] = n0, n1, n2
    depth = face(facets, boundary, step, y, o, (f, q))
    facets.gap[f, q] = gap - dt * (n0 * u[0] + n1 * u[1] + n2 * u[2]) - LEFT * depth
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
