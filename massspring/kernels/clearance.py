"""How far every node ends the predicted step from the nearest obstacle: all nodes, side by side.

Literals such as 0.0 are avoided: they turn a loop over single numbers into one over double ones.
"""

import math

from massspring.kernels.compiled import inlined
from massspring.kernels.distances import round_gap
from massspring.kernels.flat import flat


@inlined
def clearances_into(network, motion, drive, step, lam, first, last):
    """clearance_i = min over obstacles of the distance of y = x + dt (v* + dt lam W G) [m] (eq. 12); none is touched.

    Of the nodes from `first` to `last`, those that nothing can touch among them.
    """
    push, dt = drive.dt * lam, drive.dt
    touched, locked = flat(motion.touched, first, last), flat(motion.locked, first, last)
    clearance = flat(motion.clearance, first, last)
    for i in range(clearance.shape[0]):
        touched[i], locked[i], clearance[i] = 0, 0, math.inf
    for o in range(drive.radius.shape[0]):
        point, span, radius = drive.position[step, o], drive.span[o], drive.radius[o]
        if drive.is_plane[o]:
            plane_clearance(motion, network.inverse_mass, push, dt, drive.plane_normal[o], point, first, last)
        elif span[0] == 0.0 and span[1] == 0.0 and span[2] == 0.0:
            sphere_clearance(motion, network.inverse_mass, push, dt, point, radius, first, last)
        else:
            capsule_clearance(motion, network.inverse_mass, push, dt, point, span, radius, first, last)


@inlined
def plane_clearance(motion, inverse_mass, push, dt, normal, point, first, last):
    """n·(y − p) [m]."""
    x, v_star, gradient = (
        flat(motion.x, first, last),
        flat(motion.v_star, first, last),
        flat(motion.gradient, first, last),
    )
    clearance, inverse_mass = flat(motion.clearance, first, last), flat(inverse_mass, first, last)
    real = motion.x.dtype.type
    push, dt = real(push), real(dt)
    n0, n1, n2 = real(normal[0]), real(normal[1]), real(normal[2])
    p0, p1, p2 = real(point[0]), real(point[1]), real(point[2])
    for i in range(clearance.shape[0]):
        w = push * inverse_mass[i]
        r0 = x[3 * i] + dt * (v_star[3 * i] + w * gradient[3 * i]) - p0
        r1 = x[3 * i + 1] + dt * (v_star[3 * i + 1] + w * gradient[3 * i + 1]) - p1
        r2 = x[3 * i + 2] + dt * (v_star[3 * i + 2] + w * gradient[3 * i + 2]) - p2
        clearance[i] = min(clearance[i], n0 * r0 + n1 * r1 + n2 * r2)


@inlined
def sphere_clearance(motion, inverse_mass, push, dt, centre, radius, first, last):
    """|y − c| − R [m]."""
    x, v_star, gradient = (
        flat(motion.x, first, last),
        flat(motion.v_star, first, last),
        flat(motion.gradient, first, last),
    )
    clearance, inverse_mass = flat(motion.clearance, first, last), flat(inverse_mass, first, last)
    real = motion.x.dtype.type
    push, dt, radius = real(push), real(dt), real(radius)
    c0, c1, c2 = real(centre[0]), real(centre[1]), real(centre[2])
    for i in range(clearance.shape[0]):
        w = push * inverse_mass[i]
        r0 = x[3 * i] + dt * (v_star[3 * i] + w * gradient[3 * i]) - c0
        r1 = x[3 * i + 1] + dt * (v_star[3 * i + 1] + w * gradient[3 * i + 1]) - c1
        r2 = x[3 * i + 2] + dt * (v_star[3 * i + 2] + w * gradient[3 * i + 2]) - c2
        clearance[i] = min(clearance[i], math.sqrt(r0 * r0 + r1 * r1 + r2 * r2) - radius)


@inlined
def capsule_clearance(motion, inverse_mass, push, dt, start, span, radius, first, last):
    """Distance of y to the axis less R [m]."""
    x, v_star, gradient = (
        flat(motion.x, first, last),
        flat(motion.v_star, first, last),
        flat(motion.gradient, first, last),
    )
    clearance, inverse_mass = flat(motion.clearance, first, last), flat(inverse_mass, first, last)
    real = motion.x.dtype.type
    push, dt, radius = real(push), real(dt), real(radius)
    p0, p1, p2 = real(start[0]), real(start[1]), real(start[2])
    a0, a1, a2 = real(span[0]), real(span[1]), real(span[2])
    for i in range(clearance.shape[0]):
        w = push * inverse_mass[i]
        r0 = x[3 * i] + dt * (v_star[3 * i] + w * gradient[3 * i]) - p0
        r1 = x[3 * i + 1] + dt * (v_star[3 * i + 1] + w * gradient[3 * i + 1]) - p1
        r2 = x[3 * i + 2] + dt * (v_star[3 * i + 2] + w * gradient[3 * i + 2]) - p2
        clearance[i] = min(clearance[i], round_gap(r0, r1, r2, a0, a1, a2, radius))
