"""Which surface nodes lie on which obstacle during this step."""

import math

from massspring.kernels.compiled import compiled


@compiled
def sphere_contact(s0, s1, s2, r0, r1, r2, radius):
    """(gap, normal, height) of a node at s now and at r after the predicted step, seen from the centre [m] (eq. 12).

    n = s/|s|; the node ends the step at n·r⁺ = height = √(R² − |r − n (n·r)|²), on the sphere, moved along n alone.
    A node that slides farther than R within a step has no such point: it ends on the tangent plane at r/|r|.
    """
    distance = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
    if not distance > 0.0:
        return math.inf, 0.0, 0.0, 0.0, 0.0
    now = math.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
    along = (r0 * s0 + r1 * s1 + r2 * s2) / now if now > 0.0 else 0.0
    below = radius * radius - (distance * distance - along * along)
    if along > 0.0 and below > 0.0:
        return distance - radius, s0 / now, s1 / now, s2 / now, math.sqrt(below)
    return distance - radius, r0 / distance, r1 / distance, r2 / distance, radius


@compiled
def touch(motion, drive, step, node, u0, u1, u2):
    """Puts the node on the obstacle it would enter deepest when moving with u [m/s]; the smallest gap [m] (eq. 12).

    Plane: gap = n·(x + dt u − p). Sphere: gap = |x + dt u − c| − R.
    `approach` a = n·(target − x)/dt ends the step on the obstacle. A sphere pushes along n = (x − c)/|x − c| of the
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
            height = 0.0
        else:
            gap, n0, n1, n2, height = sphere_contact(x0 - p0, x1 - p1, x2 - p2, r0, r1, r2, drive.radius[o])
        if gap < nearest:
            nearest = gap
            if gap < 0.0:
                motion.touched[node] = o + 1
                motion.normal[node, 0], motion.normal[node, 1], motion.normal[node, 2] = n0, n1, n2
                along = n0 * (p0 - x0) + n1 * (p1 - x1) + n2 * (p2 - x2)
                motion.approach[node] = (along + height) / dt
    return nearest


@compiled
def find_contacts(network, motion, drive, step, lam):
    """Touched nodes of the step when the last pressure acts as a force: u = v* + dt lam W G (eq. 12)."""
    for c in range(network.surface_nodes.shape[0]):
        i = network.surface_nodes[c]
        motion.touched[i] = 0
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


@compiled
def revise_contacts(network, motion, drive, step, lam, reach):
    """Releases nodes that an obstacle would pull, adds nodes that would enter one; the number of changes (eq. 13).

    `reach` [m] is how far the new pressure can have moved a node from where `clearance` was measured: distances to
    planes and spheres change by no more, so a free node farther away need not be looked at.
    """
    changes = 0
    for c in range(network.surface_nodes.shape[0]):
        i = network.surface_nodes[c]
        if network.inverse_mass[i] == 0.0 or (motion.touched[i] == 0 and motion.clearance[i] > reach):
            continue
        push = drive.dt * lam * network.inverse_mass[i]
        u0 = motion.v_star[i, 0] + push * motion.gradient[i, 0]
        u1 = motion.v_star[i, 1] + push * motion.gradient[i, 1]
        u2 = motion.v_star[i, 2] + push * motion.gradient[i, 2]
        if motion.touched[i] > 0:
            along = u0 * motion.normal[i, 0] + u1 * motion.normal[i, 1] + u2 * motion.normal[i, 2]
            if motion.approach[i] < along:
                motion.touched[i] = 0
                # A released node is looked at again, whatever the pressure becomes.
                motion.clearance[i] = 0.0
                changes += 1
        elif touch(motion, drive, step, i, u0, u1, u2) < 0.0:
            changes += 1
    return changes


@compiled
def pressure_reach(lam_change, mobility, lightest, dt):
    """dt² |Δlam| √(max w · Σ w |G|²) ≥ dt² |Δlam| w_i |G_i| [m]: how far a change of pressure moves any free node."""
    return 1.0001 * dt * dt * abs(lam_change) * math.sqrt(max(lightest * mobility, 0.0))
