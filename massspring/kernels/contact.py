"""Which surface nodes lie on which obstacles during this step, and what motion that leaves them.

Small functions take numbers, not tuples of arrays: a call that is not inlined counts the references of every array it
is given, which costs 200 ns. What is rare (friction, two obstacles at once) has loops of its own, once per step.
"""

import math

from massspring.kernels.compiled import compiled

SLIPS = 1.0 + 1e-9
"""Round-off must not turn a node that just sticks into one that slips."""
PARALLEL = 1e-4
"""Squared sine between two normals (0.6°) below which they count as one: there is no edge to slide along."""


@compiled
def allowed_part(locked, d0, d1, d2, g0, g1, g2):
    """P g, what obstacles leave of a vector: P = I − n nᵀ on one, e eᵀ on two, 0 where a node sticks (eq. 9)."""
    along = g0 * d0 + g1 * d1 + g2 * d2
    if locked == 1:
        return g0 - along * d0, g1 - along * d1, g2 - along * d2
    if locked == 2:
        return along * d0, along * d1, along * d2
    return 0.0, 0.0, 0.0


@compiled
def axis_share(r0, r1, r2, s0, s1, s2):
    """Where on a segment 0 … s the point nearest to r lies, 0 … 1; 0 where s has no length."""
    square = s0 * s0 + s1 * s1 + s2 * s2
    return min(max((r0 * s0 + r1 * s1 + r2 * s2) / square, 0.0), 1.0) if square > 0.0 else 0.0


@compiled
def sphere_contact(s0, s1, s2, r0, r1, r2, radius):
    """(gap, normal, lift) of a node at s now and at r after the predicted step, seen from the centre [m] (eq. 12).

    n = s/|s|; the node ends the step at n·r⁺ = n·r + lift = √(R² − |r − n (n·r)|²), on the sphere, moved along n alone.
    A node that slides farther than R within a step has no such point: it ends on the tangent plane at r/|r|.
    """
    distance = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
    if not distance > 0.0:
        return math.inf, 0.0, 0.0, 0.0, 0.0
    now = math.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
    along = (r0 * s0 + r1 * s1 + r2 * s2) / now if now > 0.0 else 0.0
    below = radius * radius - (distance * distance - along * along)
    if along > 0.0 and below > 0.0:
        return distance - radius, s0 / now, s1 / now, s2 / now, math.sqrt(below) - along
    return distance - radius, r0 / distance, r1 / distance, r2 / distance, radius - distance


@compiled
def round_contact(s0, s1, s2, r0, r1, r2, a0, a1, a2, radius):
    """`sphere_contact` with the sphere around the nearest point of an axis 0 … a, a capsule's; a = 0: a sphere's.

    Along the side both points are seen from the axis. A node that passes between side and end ends on the tangent plane.
    """
    now, then = axis_share(s0, s1, s2, a0, a1, a2), axis_share(r0, r1, r2, a0, a1, a2)
    r0, r1, r2 = r0 - then * a0, r1 - then * a1, r2 - then * a2
    if now == then or (0.0 < now < 1.0 and 0.0 < then < 1.0):
        return sphere_contact(s0 - now * a0, s1 - now * a1, s2 - now * a2, r0, r1, r2, radius)
    return sphere_contact(r0, r1, r2, r0, r1, r2, radius)


@compiled
def touch(motion, drive, step, node, u0, u1, u2):
    """Puts the node on the obstacle it would enter deepest when moving with u [m/s]; the smallest gap [m] (eq. 12).

    Plane: gap = n·(x + dt u − p). Sphere, capsule: gap = distance of x + dt u to centre or axis − R.
    `goal` n a, a = n·(target − x)/dt, ends the step on the obstacle. A round one pushes along n = (x − c)/|x − c| of the
    position now, not of the prediction: that would do work on a node that slides, and pump its oscillations up.
    """
    nearest = math.inf
    dt = drive.dt
    x0, x1, x2 = motion.x[node, 0], motion.x[node, 1], motion.x[node, 2]
    for o in range(drive.radius.shape[0]):
        p0, p1, p2 = drive.position[step, o, 0], drive.position[step, o, 1], drive.position[step, o, 2]
        r0, r1, r2 = x0 + dt * u0 - p0, x1 + dt * u1 - p1, x2 + dt * u2 - p2
        if drive.is_plane[o]:
            n0, n1, n2 = drive.plane_normal[o, 0], drive.plane_normal[o, 1], drive.plane_normal[o, 2]
            gap = n0 * r0 + n1 * r1 + n2 * r2
            lift = -gap
        else:
            a0, a1, a2 = drive.span[o, 0], drive.span[o, 1], drive.span[o, 2]
            gap, n0, n1, n2, lift = round_contact(
                x0 - p0, x1 - p1, x2 - p2, r0, r1, r2, a0, a1, a2, drive.radius[o]
            )
        if gap < nearest:
            nearest = gap
            if gap < 0.0:
                a = n0 * u0 + n1 * u1 + n2 * u2 + lift / dt
                motion.touched[node], motion.locked[node] = o + 1, 1
                motion.normal[node, 0], motion.normal[node, 1], motion.normal[node, 2] = n0, n1, n2
                motion.direction[node, 0], motion.direction[node, 1], motion.direction[node, 2] = n0, n1, n2
                motion.goal[node, 0], motion.goal[node, 1], motion.goal[node, 2] = a * n0, a * n1, a * n2
    return nearest


@compiled
def find_contacts(network, motion, drive, step, lam):
    """Touched nodes of the step when the last pressure acts as a force: u = v* + dt lam W G (eq. 12)."""
    for c in range(network.surface_nodes.shape[0]):
        i = network.surface_nodes[c]
        motion.touched[i], motion.locked[i] = 0, 0
        if network.inverse_mass[i] > 0.0:
            push = drive.dt * lam * network.inverse_mass[i]
            motion.clearance[i] = touch(
                motion,
                drive,
                step,
                i,
                motion.v_star[i, 0] + push * motion.gradient[i, 0],
                motion.v_star[i, 1] + push * motion.gradient[i, 1],
                motion.v_star[i, 2] + push * motion.gradient[i, 2],
            )
    if drive.rough:
        rub(network, motion, drive, step, lam)
    if drive.radius.shape[0] > 1:
        wedge(network, motion, drive, step, lam)


@compiled
def revise_contacts(network, motion, drive, step, lam, reach):
    """Releases nodes that an obstacle would pull, adds nodes that would enter one; the number of changes (eq. 13).

    `reach` [m] is how far the new pressure can have moved a node from where `clearance` was measured: distances to
    obstacles change by no more, so a free node farther away need not be looked at.
    """
    changes = 0
    if drive.rough:
        changes += release_slipping(network, motion, drive, lam)
    if drive.radius.shape[0] > 1:
        changes += release_wedged(network, motion, drive, lam) + wedge(network, motion, drive, step, lam)
    for c in range(network.surface_nodes.shape[0]):
        i = network.surface_nodes[c]
        locked = motion.locked[i]
        if network.inverse_mass[i] == 0.0 or locked == 2 or (locked == 0 and motion.clearance[i] > reach):
            continue
        push = drive.dt * lam * network.inverse_mass[i]
        u0 = motion.v_star[i, 0] + push * motion.gradient[i, 0]
        u1 = motion.v_star[i, 1] + push * motion.gradient[i, 1]
        u2 = motion.v_star[i, 2] + push * motion.gradient[i, 2]
        if locked > 0:
            n0, n1, n2 = motion.normal[i, 0], motion.normal[i, 1], motion.normal[i, 2]
            a = motion.goal[i, 0] * n0 + motion.goal[i, 1] * n1 + motion.goal[i, 2] * n2
            if a < u0 * n0 + u1 * n1 + u2 * n2:
                motion.touched[i], motion.locked[i] = 0, 0
                # A released node is looked at again, whatever the pressure becomes.
                motion.clearance[i] = 0.0
                changes += 1
        elif touch(motion, drive, step, i, u0, u1, u2) < 0.0:
            changes += 1
    return changes


@compiled
def rub(network, motion, drive, step, lam):
    """Coulomb: a touched node sticks while |s| ≤ mu (a − n·u), else its slip s loses mu (a − n·u) (eq. 36)."""
    for c in range(network.surface_nodes.shape[0]):
        i = network.surface_nodes[c]
        if motion.locked[i] != 1 or not drive.friction[motion.touched[i] - 1] > 0.0:
            continue
        o = motion.touched[i] - 1
        push = drive.dt * lam * network.inverse_mass[i]
        n0, n1, n2 = motion.normal[i, 0], motion.normal[i, 1], motion.normal[i, 2]
        u0 = motion.v_star[i, 0] + push * motion.gradient[i, 0]
        u1 = motion.v_star[i, 1] + push * motion.gradient[i, 1]
        u2 = motion.v_star[i, 2] + push * motion.gradient[i, 2]
        g0, g1, g2 = motion.goal[i, 0], motion.goal[i, 1], motion.goal[i, 2]
        pressed = drive.friction[o] * ((g0 - u0) * n0 + (g1 - u1) * n1 + (g2 - u2) * n2)
        w0, w1, w2 = drive.velocity[step, o, 0], drive.velocity[step, o, 1], drive.velocity[step, o, 2]
        s0, s1, s2 = allowed_part(1, n0, n1, n2, u0 - w0, u1 - w1, u2 - w2)
        slip = math.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
        if slip <= pressed:
            w0, w1, w2 = allowed_part(1, n0, n1, n2, w0, w1, w2)
            motion.locked[i] = 3
            motion.goal[i, 0], motion.goal[i, 1], motion.goal[i, 2] = g0 + w0, g1 + w1, g2 + w2
        else:
            lost = pressed / slip
            motion.goal[i, 0], motion.goal[i, 1], motion.goal[i, 2] = g0 - lost * s0, g1 - lost * s1, g2 - lost * s2


@compiled
def release_slipping(network, motion, drive, lam):
    """Lets nodes slip that stick although the solved pressure asks for more than mu times its normal part (eq. 36)."""
    changes = 0
    for c in range(network.surface_nodes.shape[0]):
        i = network.surface_nodes[c]
        if motion.locked[i] != 3:
            continue
        push = drive.dt * lam * network.inverse_mass[i]
        n0, n1, n2 = motion.normal[i, 0], motion.normal[i, 1], motion.normal[i, 2]
        k0 = motion.goal[i, 0] - motion.v_star[i, 0] - push * motion.gradient[i, 0]
        k1 = motion.goal[i, 1] - motion.v_star[i, 1] - push * motion.gradient[i, 1]
        k2 = motion.goal[i, 2] - motion.v_star[i, 2] - push * motion.gradient[i, 2]
        along = k0 * n0 + k1 * n1 + k2 * n2
        s0, s1, s2 = allowed_part(1, n0, n1, n2, k0, k1, k2)
        needed, most = math.sqrt(s0 * s0 + s1 * s1 + s2 * s2), drive.friction[motion.touched[i] - 1] * along
        if along > 0.0 and needed > SLIPS * most:
            a = motion.goal[i, 0] * n0 + motion.goal[i, 1] * n1 + motion.goal[i, 2] * n2
            g0, g1, g2 = a * n0 + most / needed * s0, a * n1 + most / needed * s1, a * n2 + most / needed * s2
            motion.locked[i] = 1
            motion.goal[i, 0], motion.goal[i, 1], motion.goal[i, 2] = g0, g1, g2
            changes += 1
    return changes


@compiled
def wedge(network, motion, drive, step, lam):
    """Puts nodes that would leave their obstacle into another on the edge e = n × n' of both (eq. 37); how many.

    Obstacles that face each other have no edge: the deeper one wins, and the other's penetration is recorded.
    """
    changes = 0
    dt = drive.dt
    for c in range(network.surface_nodes.shape[0]):
        i = network.surface_nodes[c]
        if motion.locked[i] != 1:
            continue
        push = dt * lam * network.inverse_mass[i]
        n0, n1, n2 = motion.normal[i, 0], motion.normal[i, 1], motion.normal[i, 2]
        u0 = motion.v_star[i, 0] + push * motion.gradient[i, 0]
        u1 = motion.v_star[i, 1] + push * motion.gradient[i, 1]
        u2 = motion.v_star[i, 2] + push * motion.gradient[i, 2]
        u0, u1, u2 = allowed_part(1, n0, n1, n2, u0, u1, u2)
        u0, u1, u2 = u0 + motion.goal[i, 0], u1 + motion.goal[i, 1], u2 + motion.goal[i, 2]
        y0, y1, y2 = motion.x[i, 0] + dt * u0, motion.x[i, 1] + dt * u1, motion.x[i, 2] + dt * u2
        deepest = 0.0
        for o in range(drive.radius.shape[0]):
            if o + 1 == motion.touched[i]:
                continue
            p0, p1, p2 = drive.position[step, o, 0], drive.position[step, o, 1], drive.position[step, o, 2]
            if drive.is_plane[o]:
                m0, m1, m2 = drive.plane_normal[o, 0], drive.plane_normal[o, 1], drive.plane_normal[o, 2]
                gap = m0 * (y0 - p0) + m1 * (y1 - p1) + m2 * (y2 - p2)
            else:
                a0, a1, a2 = drive.span[o, 0], drive.span[o, 1], drive.span[o, 2]
                m0, m1, m2 = y0 - p0, y1 - p1, y2 - p2
                share = axis_share(m0, m1, m2, a0, a1, a2)
                m0, m1, m2 = m0 - share * a0, m1 - share * a1, m2 - share * a2
                distance = math.sqrt(m0 * m0 + m1 * m1 + m2 * m2)
                if not distance > 0.0:
                    continue
                gap = distance - drive.radius[o]
                m0, m1, m2 = m0 / distance, m1 / distance, m2 / distance
            e0, e1, e2 = n1 * m2 - n2 * m1, n2 * m0 - n0 * m2, n0 * m1 - n1 * m0
            square = e0 * e0 + e1 * e1 + e2 * e2
            if gap < deepest and square > PARALLEL:
                deepest = gap
                # goal = α n + β m with n·goal = a and m·goal = b.
                a, b = n0 * u0 + n1 * u1 + n2 * u2, m0 * u0 + m1 * u1 + m2 * u2 - gap / dt
                cosine, root = n0 * m0 + n1 * m1 + n2 * m2, math.sqrt(square)
                alpha, beta = (a - cosine * b) / square, (b - cosine * a) / square
                motion.second[i] = o + 1
                motion.second_normal[i, 0], motion.second_normal[i, 1], motion.second_normal[i, 2] = m0, m1, m2
                motion.direction[i, 0], motion.direction[i, 1], motion.direction[i, 2] = e0 / root, e1 / root, e2 / root
                motion.goal[i, 0] = alpha * n0 + beta * m0
                motion.goal[i, 1] = alpha * n1 + beta * m1
                motion.goal[i, 2] = alpha * n2 + beta * m2
        if deepest < 0.0:
            motion.locked[i] = 2
            changes += 1
    return changes


@compiled
def shares(k0, k1, k2, n0, n1, n2, m0, m1, m2):
    """The parts of k = α n + β n' + rest along two normals that are not parallel: (α, β)."""
    along, other = k0 * n0 + k1 * n1 + k2 * n2, k0 * m0 + k1 * m1 + k2 * m2
    cosine = n0 * m0 + n1 * m1 + n2 * m2
    square = 1.0 - cosine * cosine
    return (along - cosine * other) / square, (other - cosine * along) / square


@compiled
def release_wedged(network, motion, drive, lam):
    """Frees nodes in a wedge that one of their obstacles would pull; the next search finds the other (eq. 37)."""
    changes = 0
    for c in range(network.surface_nodes.shape[0]):
        i = network.surface_nodes[c]
        if motion.locked[i] != 2:
            continue
        push = drive.dt * lam * network.inverse_mass[i]
        u0 = motion.v_star[i, 0] + push * motion.gradient[i, 0]
        u1 = motion.v_star[i, 1] + push * motion.gradient[i, 1]
        u2 = motion.v_star[i, 2] + push * motion.gradient[i, 2]
        # What the edge leaves free is at right angles to both normals and takes no share.
        alpha, beta = shares(
            motion.goal[i, 0] - u0,
            motion.goal[i, 1] - u1,
            motion.goal[i, 2] - u2,
            motion.normal[i, 0],
            motion.normal[i, 1],
            motion.normal[i, 2],
            motion.second_normal[i, 0],
            motion.second_normal[i, 1],
            motion.second_normal[i, 2],
        )
        if alpha < 0.0 or beta < 0.0:
            motion.touched[i], motion.locked[i], motion.clearance[i] = 0, 0, 0.0
            changes += 1
    return changes


@compiled
def pressure_reach(lam_change, mobility, lightest, dt):
    """dt² |Δlam| √(max w · Σ w |G|²) ≥ dt² |Δlam| w_i |G_i| [m]: how far a change of pressure moves any free node."""
    return 1.0001 * dt * dt * abs(lam_change) * math.sqrt(max(lightest * mobility, 0.0))
