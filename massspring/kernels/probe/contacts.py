"""Contacts of points with triangles of a body whose volume is kept: one small dense system (docs/theory.md, section
11).

A contact at the weights b of a triangle couples its three nodes. With u the velocity without these contacts,

    v⁺_i = u_i + W̃_i (Σ_k b_ki n_k c_k + dt δ G_i),  n_k·(Σ_i b_ki x⁺_i − tip⁺) ≥ radius,  c_k ≥ 0,
    Σ G_i·(v⁺_i − u_i) = 0.

Eliminating the change of pressure δ leaves A c ≥ right with A_kl = Σ_i b_ki b_li n_k·W̃_i n_l − g_k·S⁻¹ g_l.
"""

from massspring.kernels.constraint.schur import solve_dense
from massspring.kernels.contact.node_contact import allowed
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.vec3 import add_to, dot, put, row, times
from massspring.kernels.probe.pressure import answer_into, change_of_rows, flow_into

RIGID = 1e-10
"""Relative addition to the diagonal of A: of two contacts on one edge, which are the same condition, the weaker is
dropped."""
IDLE = 1e-9
"""Share of the diagonal without the volume term below which a contact has nothing to move."""
SWAPS = 8
"""Most changes of the pressing set, per row; two are usual."""
SLACK = 1e-9
"""Violation allowed for a contact that does not press, over the largest right side: round-off."""


@njit_lean
def row_of(rows, p, f):
    """Index of the row of a probe and a triangle; the number of rows if there is none."""
    count = rows.count[0]
    for k in range(count):
        if rows.probe[k] == p and rows.triangle[k] == f:
            return k
    return count


@njit_lean
def set_row(rows, p, f, triangles, pair):
    """Stores the contact in `pair` as the row of probe p and triangle f. Returns whether there is room for it."""
    k = row_of(rows, p, f)
    if k == rows.triangle.shape[0]:
        return False
    rows.count[0] = max(rows.count[0], k + 1)
    rows.probe[k], rows.triangle[k] = p, f
    for q in range(3):
        rows.node[k, q] = triangles[f, q]
        rows.weight[k, q] = pair.weight[q]
        rows.direction[k, q] = pair.direction[q]
    return True


@njit_lean
def aim_rows(stage):
    """W̃ n and the right side of every row (eq. 11.6).

    right_k = [radius − n·(Σ b x − tip⁺)]/dt − n·Σ b u [m/s].
    """
    rows, nodes, probes = stage.probes.rows, stage.nodes, stage.probes
    for k in range(rows.count[0]):
        p, d = rows.probe[k], row(rows.direction, k)
        gap, approach = -dot(d, row(stage.tips.end[stage.step], p)), 0.0
        for q in range(3):
            i, b = rows.node[k, q], rows.weight[k, q]
            approach += b * dot(d, row(probes.base, i))
            gap += b * dot(d, row(nodes.x, i))
            put(rows.moves[k], q, times(stage.model.inverse_mass[i], allowed(stage.contacts, i, d)))
        rows.right[k] = (probes.radius[p] - gap) / stage.dt - approach


@njit_lean
def matrix_into(rows):
    """A_kj = Σ_i b_ki b_ji n_k·W̃_i n_j − g_k·S⁻¹ g_j [1/kg], both halves (eq. 11.6)."""
    for k in range(rows.count[0]):
        for j in range(k + 1):
            shared = 0.0
            for q in range(3):
                for r in range(3):
                    if rows.node[k, q] == rows.node[j, r]:
                        along = 0.0
                        for axis in range(3):
                            along += rows.moves[k, q, axis] * rows.direction[j, axis]
                        shared += rows.weight[k, q] * rows.weight[j, r] * along
            value = shared
            for r in range(rows.flow.shape[1]):
                value -= rows.flow[k, r] * rows.answer[j, r]
            if k == j:
                # If all other nodes are held, the volume constraint may leave a triangle no motion.
                value = max(value, IDLE * shared) * (1.0 + RIGID)
            rows.matrix[k, j], rows.matrix[j, k] = value, value


@njit_lean
def press(rows):
    """A_aa c_a = right_a for the rows that press, the others 0 [N s] (eq. 11.6)."""
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


@njit_lean
def choose_rows(rows):
    """Solves c ≥ 0, A c ≥ right, with equality in one of the two in every row, so that no contact pulls (eq. 11.6)."""
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


@njit_lean
def spread_push(rows, push, inverse_mass):
    """push_i = Σ_k b_ki c_k W̃_i n_k [m/s] of the corners of all rows. Returns an upper bound on it, Σ w b c [m/s]."""
    clear_push(rows, push)
    fastest = 0.0
    for k in range(rows.count[0]):
        for q in range(3):
            i, share = rows.node[k, q], rows.weight[k, q] * rows.impulse[k]
            add_to(push, i, times(share, row(rows.moves[k], q)))
            fastest += inverse_mass[i] * share
    return fastest


@njit_lean
def clear_push(rows, push):
    """Sets the pushes of all rows to 0."""
    for k in range(rows.count[0]):
        for q in range(3):
            put(push, rows.node[k, q], (0.0, 0.0, 0.0))


@njit_lean
def solve_rows(stage, volumes):
    """Computes the impulses of all rows and the change of pressures. Returns a bound on the velocity that they add to a
    node [m/s] (eq. 11.6)."""
    rows = stage.probes.rows
    aim_rows(stage)
    for k in range(rows.count[0]):
        flow_into(stage, volumes, k)
        answer_into(stage, volumes, rows.flow[k], rows.answer[k])
    matrix_into(rows)
    choose_rows(rows)
    return spread_push(rows, stage.probes.push, stage.model.inverse_mass) + change_of_rows(stage)
