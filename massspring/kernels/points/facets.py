"""Contact at points inside quadratic facets, by impulses that leave nothing inside at the end of the step.

At a corner of a quadratic facet a uniform pressure leaves no force, so that nodes alone meet an obstacle unevenly. Here
the force acts where the facet is: 0 ≤ f ⟂ g ≥ 0 with the gap g that the step would end with, solved for point after
point from the forces of the last step (projected Gauss–Seidel; Moreau 1988, Jourdan, Alart, Jean 1998; theory, eq.
9.3–9.5). Friction acts the same way along the facet.
"""

import math

from massspring.kernels.contact.gaps import gap_and_normal
from massspring.kernels.jit.decorators import njit_inlined, njit_lean

SWEEPS = 40
"""Over all points, at most."""
LEFT = 0.8
"""Of what is inside at the start of a step that may be inside at its end: pressures answer a step later, and to push
all of it out at once would shake the body."""
NEARLY = 1.0 - 1e-9
"""Of the square of a force that was cut to its limit: round-off."""
SETTLED = 1e-6
"""Change of the forces in a sweep, over the largest, at which they stand: what is left shakes a body at rest."""


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
def deepest(facets, boundary, step, y):
    """The obstacle that the point y is deepest in, and its gap [m]."""
    best, least = 0, math.inf
    for o in range(boundary.radius.shape[0]):
        place = boundary.position[step, o]
        gap, _, _, _ = gap_and_normal(boundary, o, y[0] - place[0], y[1] - place[1], y[2] - place[2])
        if gap < least:
            best, least = o, gap
    return best, least


@njit_inlined
def forget(facets, f, q):
    """Nothing is touched at point q."""
    facets.contact_id[f, q], facets.pressing[f, q] = 0, 0.0
    for axis in range(3):
        facets.dragging[f, q, axis] = 0.0


@njit_inlined
def rub(facets, f, q, k, most, place):
    """Moves the force along the obstacle [N] towards where friction holds the point: Coulomb's, at most `most`.

    `k` [N/m] takes back a whole way within the step; `place` (3) [m]: where the point would end the step, seen from the
    obstacle.
    """
    drag, anchor, normal = facets.dragging, facets.anchor, facets.normal
    t0 = drag[f, q, 0] - k * (place[0] - anchor[f, q, 0])
    t1 = drag[f, q, 1] - k * (place[1] - anchor[f, q, 1])
    t2 = drag[f, q, 2] - k * (place[2] - anchor[f, q, 2])
    inward = t0 * normal[f, q, 0] + t1 * normal[f, q, 1] + t2 * normal[f, q, 2]
    t0, t1, t2 = t0 - inward * normal[f, q, 0], t1 - inward * normal[f, q, 1], t2 - inward * normal[f, q, 2]
    size = math.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
    if size > most:
        part = most / size
        t0, t1, t2 = part * t0, part * t1, part * t2
    drag[f, q, 0], drag[f, q, 1], drag[f, q, 2] = t0, t1, t2


@njit_inlined
def slides(facets, boundary, o, f, q):
    """Whether the force along obstacle o is all that friction gives: the point is held where the step ends."""
    if not boundary.friction[o] > 0.0:
        return False
    drag, most = facets.dragging, boundary.friction[o] * facets.pressing[f, q]
    square = drag[f, q, 0] ** 2 + drag[f, q, 1] ** 2 + drag[f, q, 2] ** 2
    return square >= NEARLY * most * most


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
def touch(facets, boundary, step, y, o, place):
    """Point `place` (f, q) at y [m] touches obstacle o from now on, along the normal where it is now.

    Along that of the prediction a round obstacle would do work on what slides over it.
    """
    f, q = place
    centre, v, dt = boundary.position[step, o], boundary.velocity[step, o], boundary.dt
    _, n0, n1, n2 = gap_and_normal(boundary, o, y[0] - centre[0], y[1] - centre[1], y[2] - centre[2])
    facets.normal[f, q, 0], facets.normal[f, q, 1], facets.normal[f, q, 2] = n0, n1, n2
    if facets.contact_id[f, q] != o + 1:
        forget(facets, f, q)
        facets.contact_id[f, q] = o + 1
        for axis in range(3):
            facets.anchor[f, q, axis] = y[axis] - (centre[axis] - dt * v[axis])


@njit_inlined
def depth_now(boundary, step, y, o):
    """The gap of y to obstacle o at the start of the step where it is inside [m], else 0."""
    centre, v, dt = boundary.position[step, o], boundary.velocity[step, o], boundary.dt
    r0, r1, r2 = y[0] - centre[0] + dt * v[0], y[1] - centre[1] + dt * v[1], y[2] - centre[2] + dt * v[2]
    return min(gap_and_normal(boundary, o, r0, r1, r2)[0], 0.0)


@njit_inlined
def press(facets, boundary, step, state, f, q):
    """Corrects the force on point q of facet f so that it ends the step outside; `state`: its position and speed."""
    y, u = state
    dt = boundary.dt
    end = y[0] + dt * u[0], y[1] + dt * u[1], y[2] + dt * u[2]
    o, gap = deepest(facets, boundary, step, end)
    if facets.contact_id[f, q] == 0 and not gap < 0.0:
        return
    if facets.contact_id[f, q] != o + 1:
        if not gap < 0.0:
            forget(facets, f, q)
            return
        touch(facets, boundary, step, y, o, (f, q))
    k = facets.mass[f, q] / (dt * dt)
    force = facets.pressing[f, q] - k * (gap - LEFT * depth_now(boundary, step, y, o))
    if not force > 0.0:
        facets.pressing[f, q] = 0.0
        for axis in range(3):
            facets.dragging[f, q, axis] = 0.0
        return
    facets.pressing[f, q] = force
    if boundary.friction[o] > 0.0:
        centre = boundary.position[step, o]
        rub(facets, f, q, k, boundary.friction[o] * force, (end[0] - centre[0], end[1] - centre[1], end[2] - centre[2]))


@njit_inlined
def add_at_point(facets, field, force, f, q):
    """A force (3) [N] at point q of facet f: what its nodes have of it, into `field` (n, 3)."""
    for a in range(6):
        i, share = facets.node[f, a], facets.shape[q, a]
        for axis in range(3):
            field[i, axis] += share * force[axis]


@njit_lean
def known_forces_into(nodes, facets, boundary, step, field):
    """What all points had in the last step [N], along the normals of now, into `field` (n, 3)."""
    field[:] = 0.0
    for f in range(facets.node.shape[0]):
        for q in range(facets.shape.shape[0]):
            if facets.contact_id[f, q] > 0:
                y = at_point(nodes.x, facets.node, facets.shape[q], f)
                touch(facets, boundary, step, y, facets.contact_id[f, q] - 1, (f, q))
                add_at_point(facets, field, force_at(facets, f, q), f, q)


@njit_inlined
def list_near(facets, nodes, boundary, step):
    """How many facets touch an obstacle or may come to do so in this step, listed in `near`."""
    count = 0
    for f in range(facets.node.shape[0]):
        wanted = not is_far(facets, nodes, boundary, step, f)
        for q in range(facets.shape.shape[0]):
            wanted |= facets.contact_id[f, q] > 0
        if wanted:
            facets.near[count] = f
            count += 1
    return count


@njit_inlined
def sweep_over(nodes, facets, boundary, step, speed, field, inverse_mass, count):
    """`press` for all points of the first `count` facets in `near`; the largest change of a force, and the largest."""
    node, dt, changed, largest = facets.node, boundary.dt, 0.0, 0.0
    for k in range(count):
        f = facets.near[k]
        for q in range(facets.shape.shape[0]):
            weights = facets.shape[q]
            y, u = at_point(nodes.x, node, weights, f), at_point(speed, node, weights, f)
            k0, k1, k2 = force_at(facets, f, q)
            press(facets, boundary, step, (y, u), f, q)
            f0, f1, f2 = force_at(facets, f, q)
            change = f0 - k0, f1 - k1, f2 - k2
            changed = max(changed, abs(change[0]) + abs(change[1]) + abs(change[2]))
            largest = max(largest, abs(f0) + abs(f1) + abs(f2))
            add_at_point(facets, field, change, f, q)
            for a in range(6):
                i = node[f, a]
                for axis in range(3):
                    speed[i, axis] += dt * inverse_mass[i] * weights[a] * change[axis]
    return changed, largest


@njit_lean
def corrections_into(nodes, facets, boundary, step, speed, field, inverse_mass, contact_impulse):
    """What changes of the forces of all points [N], into `field` (n, 3); books the impulses of the obstacles.

    `speed` (n, 4): of nodes under the forces that were known [m/s]; a correction moves it for the points that follow.
    """
    field[:] = 0.0
    count = list_near(facets, nodes, boundary, step)
    for _ in range(SWEEPS):
        changed, largest = sweep_over(nodes, facets, boundary, step, speed, field, inverse_mass, count)
        if not changed > SETTLED * largest:
            break
    dt, node = boundary.dt, facets.node
    for k in range(count):
        f = facets.near[k]
        for q in range(facets.shape.shape[0]):
            if facets.contact_id[f, q] == 0:
                continue
            o = facets.contact_id[f, q] - 1
            f0, f1, f2 = force_at(facets, f, q)
            contact_impulse[o, 0] += dt * f0
            contact_impulse[o, 1] += dt * f1
            contact_impulse[o, 2] += dt * f2
            if f0 == 0.0 and f1 == 0.0 and f2 == 0.0:
                forget(facets, f, q)
            elif slides(facets, boundary, o, f, q):
                y, u = at_point(nodes.x, node, facets.shape[q], f), at_point(speed, node, facets.shape[q], f)
                for axis in range(3):
                    facets.anchor[f, q, axis] = y[axis] + dt * u[axis] - boundary.position[step, o, axis]
