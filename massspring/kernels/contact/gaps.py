"""Distances of nodes from obstacles at the end of the predicted step: for all nodes at once, or for one.

The loops over all nodes avoid literals such as 0.0: these are float64 and would turn a loop over float32 into one over
float64.
"""

import math

from massspring.kernels.contact.node_contact import axis_share, round_gap
from massspring.kernels.jit.decorators import njit_inlined
from massspring.kernels.jit.flat import flat
from massspring.kernels.jit.vec3 import dot, minus, over, plus, row, times


@njit_inlined
def predicted_gaps_into(model, nodes, contacts, boundary, step, push):
    """gap_i = min over the obstacles that touch nodes of the distance of y = x + dt (v* + dt W f) [m], f the push (eq.
    3.7).

    Of all nodes, those that nothing can touch among them.
    """
    n, real = nodes.x.shape[0], nodes.x.dtype.type
    x, v_star = flat(nodes.x, 0, n), flat(nodes.v_star, 0, n)
    direction, inverse_mass = flat(push.direction, 0, n), flat(model.inverse_mass, 0, n)
    course = x, v_star, direction, inverse_mass, real(boundary.dt), real(boundary.dt * push.factor)
    predicted_gap = flat(contacts.predicted_gap, 0, n)
    for i in range(n):
        predicted_gap[i] = math.inf
    for o in range(boundary.radius.shape[0]):
        if boundary.inside[o]:
            continue
        place, span, radius = boundary.position[step, o], boundary.span[o], real(boundary.radius[o])
        p = real(place[0]), real(place[1]), real(place[2])
        if boundary.is_plane[o]:
            normal = boundary.plane_normal[o]
            plane_gap(course, predicted_gap, p, (real(normal[0]), real(normal[1]), real(normal[2])))
        elif span[0] == 0.0 and span[1] == 0.0 and span[2] == 0.0:
            sphere_gap(course, predicted_gap, p, radius)
        else:
            capsule_gap(course, predicted_gap, p, (real(span[0]), real(span[1]), real(span[2])), radius)


@njit_inlined
def way_from(p, course, i):
    """y − p [m] of a node, y = x + dt (v* + dt W f)."""
    x, v_star, direction, inverse_mass, dt, impulse = course
    w = impulse * inverse_mass[i]
    r0 = x[3 * i] + dt * (v_star[3 * i] + w * direction[3 * i]) - p[0]
    r1 = x[3 * i + 1] + dt * (v_star[3 * i + 1] + w * direction[3 * i + 1]) - p[1]
    r2 = x[3 * i + 2] + dt * (v_star[3 * i + 2] + w * direction[3 * i + 2]) - p[2]
    return r0, r1, r2


@njit_inlined
def plane_gap(course, predicted_gap, p, n):
    """n·(y − p) [m]."""
    for i in range(predicted_gap.shape[0]):
        predicted_gap[i] = min(predicted_gap[i], dot(n, way_from(p, course, i)))


@njit_inlined
def sphere_gap(course, predicted_gap, c, radius):
    """|y − c| − R [m]."""
    for i in range(predicted_gap.shape[0]):
        r = way_from(c, course, i)
        predicted_gap[i] = min(predicted_gap[i], math.sqrt(dot(r, r)) - radius)


@njit_inlined
def capsule_gap(course, predicted_gap, p, a, radius):
    """Distance of y to the axis p … p + a less R [m]."""
    for i in range(predicted_gap.shape[0]):
        predicted_gap[i] = min(predicted_gap[i], round_gap(way_from(p, course, i), a, radius))


@njit_inlined
def pushed_velocity(model, nodes, boundary, push, i):
    """u = v* + dt W f of node i [m/s], with the push on volumes as force f (eq. 3.7)."""
    w = boundary.dt * push.factor * model.inverse_mass[i]
    return plus(row(nodes.v_star, i), times(w, row(push.direction, i)))


@njit_inlined
def gap_and_normal(boundary, o, r):
    """Distance [m] of r to obstacle o, negative inside, and its normal there; r is relative to the position of the
    obstacle.

    On the axis of a sphere or capsule the normal is NaN.
    """
    if boundary.is_plane[o]:
        n = row(boundary.plane_normal, o)
        return dot(n, r), n
    a = row(boundary.span, o)
    r = minus(r, times(axis_share(r, a), a))
    distance = math.sqrt(dot(r, r))
    return distance - boundary.radius[o], over(r, distance)
