"""Which surface nodes lie on which obstacles during this step.

What is rare (friction, two obstacles at once) has loops of its own in `kernels.rubbing`, once per step.
"""

import math

from massspring.kernels.contact.friction import release_slipping, release_wedged, rub, wedge
from massspring.kernels.contact.gaps import clearances_into, gap_and_normal, pushed_velocity
from massspring.kernels.contact.modes import FREE, ON_EDGE, SLIDES
from massspring.kernels.contact.node_contact import round_contact
from massspring.kernels.jit.blocks import BLOCK, any_within
from massspring.kernels.jit.decorators import inlined, lean
from massspring.kernels.jit.thread_team import JOB_SEARCH, call, join

CONTACT_PASSES = 3
"""Active-set passes a step: one when nothing changes; lam is always solved for the set that is applied."""


@lean
def seat(network, motion, drive, step, push, count):
    """Puts the first `count` nodes of `motion.entering` on the obstacle each would enter deepest (eq. 12).

    `goal` n a, a = n·(target − x)/dt, ends the step on the obstacle. A round one pushes along n = (x − c)/|x − c| of
    the position now, not of the prediction: that would do work on a node that slides, and pump its oscillations up.
    """
    dt = drive.dt
    for k in range(count):
        i = motion.entering[k]
        u0, u1, u2 = pushed_velocity(network, motion, drive, push, i)
        deepest = 0.0
        for o in range(drive.radius.shape[0]):
            s0 = motion.x[i, 0] - drive.position[step, o, 0]
            s1 = motion.x[i, 1] - drive.position[step, o, 1]
            s2 = motion.x[i, 2] - drive.position[step, o, 2]
            r0, r1, r2 = s0 + dt * u0, s1 + dt * u1, s2 + dt * u2
            depth, n0, n1, n2 = gap_and_normal(drive, o, r0, r1, r2)
            if depth < deepest:
                deepest, lift = depth, -depth
                if not drive.is_plane[o]:
                    axis = drive.span[o, 0], drive.span[o, 1], drive.span[o, 2]
                    n0, n1, n2, lift = round_contact((s0, s1, s2), (r0, r1, r2), axis, drive.radius[o])
                a = n0 * u0 + n1 * u1 + n2 * u2 + lift / dt
                motion.touched[i], motion.locked[i] = o + 1, SLIDES
                motion.normal[i, 0], motion.normal[i, 1], motion.normal[i, 2] = n0, n1, n2
                motion.direction[i, 0], motion.direction[i, 1], motion.direction[i, 2] = n0, n1, n2
                motion.goal[i, 0], motion.goal[i, 1], motion.goal[i, 2] = a * n0, a * n1, a * n2


@inlined
def let_go(motion):
    """No node is touched."""
    for k in range(motion.touching_count[0]):
        i = motion.touching[k]
        motion.touched[i], motion.locked[i] = 0, FREE
    motion.touching_count[0] = 0


@inlined
def admit(motion, count):
    """Lists those of the first `count` nodes of `motion.entering` that have been seated; their clearance is settled."""
    touching, entering, locked = motion.touching, motion.entering, motion.locked
    listed = motion.touching_count[0]
    for k in range(count):
        i = entering[k]
        if locked[i] > FREE:
            touching[listed] = i
            motion.clearance[i] = math.inf
            listed += 1
    motion.touching_count[0] = listed


@inlined
def forget_released(motion):
    """Takes nodes that have been released from the list, so that one that comes back is in it once."""
    touching, locked, kept = motion.touching, motion.locked, 0
    for k in range(motion.touching_count[0]):
        i = touching[k]
        if locked[i] > FREE:
            touching[kept] = i
            kept += 1
    motion.touching_count[0] = kept


@inlined
def clear_all(network, motion, drive, step, push, team):
    """`clearances_into` of all nodes, by as many threads as there are."""
    if team is None:
        clearances_into(network, motion, drive, step, push, 0, motion.x.shape[0])
    else:
        call(team, JOB_SEARCH, step, push.factor)
        clearances_into(network, motion, drive, step, push, team.nodes[0], team.nodes[1])
        join(team)


@inlined
def find_contacts(network, motion, drive, step, push):
    """Touched nodes of the step when the push of the last one acts on them: u = v* + dt W f (eq. 12)."""
    let_go(motion)
    clear_all(network, motion, drive, step, push, motion.team)
    enter(network, motion, drive, step, push)


@inlined
def enter(network, motion, drive, step, push):
    """Seats the nodes whose clearance is negative (eq. 12)."""
    touchable, clearance, entering = network.touchable, motion.clearance, motion.entering
    count = 0
    for begin in range(0, clearance.shape[0], BLOCK):
        if not any_within(clearance, begin, 0.0):
            continue
        for i in range(begin, min(begin + BLOCK, clearance.shape[0])):
            if clearance[i] < 0.0 and touchable[i] > 0:
                entering[count] = i
                count += 1
    if count > 0:
        seat(network, motion, drive, step, push, count)
        admit(motion, count)
    if drive.rough:
        rub(network, motion, drive, step, push)
    if drive.radius.shape[0] > 1:
        wedge(network, motion, drive, step, push)


@inlined
def release_pulled(network, motion, drive, push):
    """Releases nodes that their one obstacle would pull (eq. 13); how many."""
    changes = 0
    for k in range(motion.touching_count[0]):
        i = motion.touching[k]
        if motion.locked[i] == FREE or motion.locked[i] == ON_EDGE:
            continue
        n0, n1, n2 = motion.normal[i, 0], motion.normal[i, 1], motion.normal[i, 2]
        u0, u1, u2 = pushed_velocity(network, motion, drive, push, i)
        if motion.goal[i, 0] * n0 + motion.goal[i, 1] * n1 + motion.goal[i, 2] * n2 < u0 * n0 + u1 * n1 + u2 * n2:
            # A released node is looked at again in the next pass, whatever the pressure becomes.
            motion.touched[i], motion.locked[i], motion.clearance[i] = 0, FREE, 0.0
            changes += 1
    return changes


@inlined
def enters(network, motion, drive, step, push, i):
    """Whether the free node i would end the step in an obstacle (eq. 12)."""
    dt = drive.dt
    u0, u1, u2 = pushed_velocity(network, motion, drive, push, i)
    y0, y1, y2 = motion.x[i, 0] + dt * u0, motion.x[i, 1] + dt * u1, motion.x[i, 2] + dt * u2
    for o in range(drive.radius.shape[0]):
        p0, p1, p2 = drive.position[step, o, 0], drive.position[step, o, 1], drive.position[step, o, 2]
        if gap_and_normal(drive, o, y0 - p0, y1 - p1, y2 - p2)[0] < 0.0:
            return True
    return False


@inlined
def revise_contacts(network, motion, drive, step, push, reach):
    """Releases nodes that an obstacle would pull, adds nodes that would enter one; the number of changes (eq. 13).

    `reach` [m] is how far the new pressure can have moved a node from where `clearance` was measured: distances to
    obstacles change by no more, so a free node farther away need not be looked at.
    """
    touchable, clearance, entering = network.touchable, motion.clearance, motion.entering
    count, changes = 0, 0
    if drive.rough:
        changes += release_slipping(network, motion, drive, push)
    if drive.radius.shape[0] > 1:
        changes += release_wedged(network, motion, drive, push) + wedge(network, motion, drive, step, push)
    for begin in range(0, clearance.shape[0], BLOCK):
        if not any_within(clearance, begin, reach):
            continue
        for i in range(begin, min(begin + BLOCK, clearance.shape[0])):
            if clearance[i] > reach or motion.locked[i] > FREE or touchable[i] == 0:
                continue
            if enters(network, motion, drive, step, push, i):
                entering[count] = i
                count += 1
    changes += release_pulled(network, motion, drive, push)
    if changes > 0:
        forget_released(motion)
    if count > 0:
        seat(network, motion, drive, step, push, count)
        admit(motion, count)
    return changes + count


@inlined
def pressure_reach(lam_change, mobility, lightest, dt):
    """dt² |Δlam| √(max w · Σ w |G|²) ≥ dt² |Δlam| w_i |G_i| [m]: how far a change of pressure moves any free node."""
    return 1.0001 * dt * dt * abs(lam_change) * math.sqrt(max(lightest * mobility, 0.0))
