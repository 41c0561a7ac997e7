"""Contacts of points with triangles beside a volume: few rows, one small dense solve (docs/theory.md, section 11).

A contact at the weights b of a triangle couples its three nodes. With u the motion of the step without any,

    v⁺_i = u_i + W̃_i (Σ_k b_ki n_k c_k + dt δ G_i),  n_k·(Σ_i b_ki x⁺_i − tip⁺) ≥ radius,  c_k ≥ 0,
    Σ G_i·(v⁺_i − u_i) = 0.

Eliminating the change of pressure δ leaves A c ≥ right with A_kl = Σ_i b_ki b_li n_k·W̃_i n_l − g_k g_l/(G·W̃·G).
"""

from massspring.kernels.compiled import compiled
from massspring.kernels.distances import allowed_part
from massspring.kernels.multipliers import solve_dense

RIGID = 1e-10
"""Added share of A's diagonal: two contacts on one edge are one, and the weaker of them goes."""
IDLE = 1e-9
"""Share of the diagonal without the volume below which a contact has nothing to move."""
SWAPS = 8
"""Changes of the set that presses, times the number of rows; two are the rule."""
SLACK = 1e-9
"""Share of the largest right side by which a contact that does not press may be missed: round-off."""


@compiled
def free_velocity(stage, i, lam):
    """u_i = v* + w (dt lam G + Σ b n c) in the directions that obstacles leave to a node [m/s] (eq. 9, 146)."""
    motion, probes = stage.motion, stage.probes
    w, push = stage.network.inverse_mass[i], stage.dt * lam
    u0 = motion.v_star[i, 0] + w * (push * motion.gradient[i, 0] + probes.push[i, 0])
    u1 = motion.v_star[i, 1] + w * (push * motion.gradient[i, 1] + probes.push[i, 1])
    u2 = motion.v_star[i, 2] + w * (push * motion.gradient[i, 2] + probes.push[i, 2])
    if motion.locked[i] > 0:
        d0, d1, d2 = motion.direction[i, 0], motion.direction[i, 1], motion.direction[i, 2]
        u0, u1, u2 = allowed_part(motion.locked[i], d0, d1, d2, u0, u1, u2)
        u0, u1, u2 = u0 + motion.goal[i, 0], u1 + motion.goal[i, 1], u2 + motion.goal[i, 2]
    return u0, u1, u2


@compiled
def row_of(rows, p, f):
    """The row of a probe and a triangle, or the number of rows."""
    count = rows.count[0]
    for k in range(count):
        if rows.probe[k] == p and rows.triangle[k] == f:
            return k
    return count


@compiled
def set_row(rows, k, p, f, pair):
    """Row k is what `pair` has found of probe p and triangle f; whether there is room for it."""
    if k == rows.triangle.shape[0]:
        return False
    rows.count[0] = max(rows.count[0], k + 1)
    rows.probe[k], rows.triangle[k] = p, f
    rows.weight[k, :] = pair.weight
    rows.direction[k, :] = pair.direction
    return True


@compiled
def spread_push(stage, share):
    """push_i += share Σ_k b_ki n_k c_k [N s]; a share of 0 takes all pushes away."""
    rows, push = stage.probes.rows, stage.probes.push
    for k in range(rows.count[0]):
        for q in range(3):
            i = stage.network.triangles[rows.triangle[k], q]
            for axis in range(3):
                b = share * rows.weight[k, q] * rows.impulse[k] * rows.direction[k, axis]
                push[i, axis] = push[i, axis] + b if share > 0.0 else 0.0


@compiled
def allowed_along(stage, i, d):
    """W̃_i d [1/kg] for a direction (3,) (eq. 9)."""
    w, motion = stage.network.inverse_mass[i], stage.motion
    p0, p1, p2 = d[0], d[1], d[2]
    if motion.locked[i] > 0:
        e0, e1, e2 = motion.direction[i, 0], motion.direction[i, 1], motion.direction[i, 2]
        p0, p1, p2 = allowed_part(motion.locked[i], e0, e1, e2, p0, p1, p2)
    return w * p0, w * p1, w * p2


@compiled
def rows_into(stage, lam, mobility):
    """A, the flows g and the right sides of all rows, with no impulse on any node (eq. 146).

    right_k = [radius − n·(Σ b x − tip⁺)]/dt − n·Σ b u [m/s].
    """
    rows, triangles, x = stage.probes.rows, stage.network.triangles, stage.motion.x
    for k in range(rows.count[0]):
        p, f, d = rows.probe[k], rows.triangle[k], rows.direction[k]
        gap, approach, flow = 0.0, 0.0, 0.0
        for q in range(3):
            i, b = triangles[f, q], rows.weight[k, q]
            u0, u1, u2 = free_velocity(stage, i, lam)
            approach += b * (d[0] * u0 + d[1] * u1 + d[2] * u2)
            for axis in range(3):
                gap += b * d[axis] * (x[i, axis] - stage.tips.end[stage.step, p, axis])
            m0, m1, m2 = allowed_along(stage, i, d)
            g = stage.motion.gradient[i]
            flow += b * (m0 * g[0] + m1 * g[1] + m2 * g[2])
        rows.right[k] = (stage.probes.radius[p] - gap) / stage.dt - approach
        rows.flow[k] = flow if mobility > 0.0 else 0.0
    for k in range(rows.count[0]):
        for j in range(k + 1):
            shared = shared_mobility(stage, k, j)
            # Without the volume a triangle always moves; with it, and all else held, it may have nowhere to go.
            volume = rows.flow[k] * rows.flow[j] / mobility if mobility > 0.0 else 0.0
            least = IDLE * shared if k == j else -1e300
            rows.matrix[k, j] = max(shared - volume, least)
            rows.matrix[j, k] = rows.matrix[k, j]
        rows.matrix[k, k] *= 1.0 + RIGID


@compiled
def shared_mobility(stage, k, j):
    """Σ_i b_ki b_ji n_k·W̃_i n_j [1/kg] over the nodes that two rows share (eq. 146)."""
    rows, triangles = stage.probes.rows, stage.network.triangles
    d, total = rows.direction[j], 0.0
    for q in range(3):
        i = triangles[rows.triangle[k], q]
        for r in range(3):
            if triangles[rows.triangle[j], r] == i:
                m0, m1, m2 = allowed_along(stage, i, rows.direction[k])
                total += rows.weight[k, q] * rows.weight[j, r] * (m0 * d[0] + m1 * d[1] + m2 * d[2])
    return total


@compiled
def press(rows):
    """A_aa c_a = right_a for the rows that press, the others 0 [N s] (eq. 146)."""
    count, active = 0, rows.active
    for k in range(rows.count[0]):
        rows.impulse[k] = 0.0
        if active[k]:
            rows.part[0, count] = rows.right[k]
            other = 0
            for j in range(k + 1):
                if active[j]:
                    rows.small[count, other] = rows.matrix[k, j]
                    other += 1
            count += 1
    solve_dense(rows.small[:count, :count], rows.part[0, :count], rows.part[1, :count])
    count = 0
    for k in range(rows.count[0]):
        if active[k]:
            rows.impulse[k] = rows.part[1, count]
            count += 1


@compiled
def choose_rows(rows):
    """c ≥ 0, A c ≥ right, and one of them equal in every row: a contact that would pull is left (eq. 146)."""
    n = rows.count[0]
    largest = 0.0
    for k in range(n):
        rows.active[k] = rows.right[k] > 0.0 and rows.matrix[k, k] > 0.0
        largest = max(largest, abs(rows.right[k]))
    for _ in range(SWAPS * n):
        press(rows)
        worst, swapped = 0.0, -1
        for k in range(n):
            if rows.active[k] and rows.impulse[k] < worst:
                worst, swapped = rows.impulse[k], k
        if swapped < 0:
            worst = SLACK * largest
            for k in range(n):
                missed = rows.right[k]
                for j in range(n):
                    missed -= rows.matrix[k, j] * rows.impulse[j]
                if not rows.active[k] and missed > worst and rows.matrix[k, k] > 0.0:
                    worst, swapped = missed, k
        if swapped < 0:
            break
        rows.active[swapped] = not rows.active[swapped]
    for k in range(n):
        rows.impulse[k] = max(rows.impulse[k], 0.0)


@compiled
def solve_rows(stage, lam, mobility):
    """Impulses of all rows; returns the pressure that keeps the volume, lam − Σ g c/(dt G·W̃·G) [Pa] (eq. 146)."""
    rows = stage.probes.rows
    spread_push(stage, 0.0)
    rows_into(stage, lam, mobility)
    choose_rows(rows)
    spread_push(stage, 1.0)
    if mobility > 0.0:
        for k in range(rows.count[0]):
            lam -= rows.flow[k] * rows.impulse[k] / (stage.dt * mobility)
    return lam
