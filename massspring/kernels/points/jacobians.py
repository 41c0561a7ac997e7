"""J at the points of quadratic tetrahedra, for records and energies; the steps have their own in blocks."""

from massspring.kernels.jit.decorators import njit_exposed
from massspring.kernels.jit.vec3 import cross, dot, plus, row, times


@njit_exposed
def jacobians_into(x, cells, slopes, weight, out):
    """J_q = (W_1 × W_2)·W_3/(24 w_q) [1] into `out` (k, p), W_i = ∂x/∂b_i at the point (eq. 8.10a).

    x: (n, 3) [m]; slopes: ∂N_a/∂b_i, (p, 10, 3); weight: w_q [m³], (k, p).
    """
    for e in range(cells.shape[0]):
        for q in range(slopes.shape[0]):
            w1, w2, w3 = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            for a in range(cells.shape[1]):
                place = row(x, cells[e, a])
                w1 = plus(w1, times(slopes[q, a, 0], place))
                w2 = plus(w2, times(slopes[q, a, 1], place))
                w3 = plus(w3, times(slopes[q, a, 2], place))
            out[e, q] = dot(cross(w1, w2), w3) / (24.0 * weight[e, q])
