"""Volumes of tetrahedra, and their smallest ratio to the rest volumes."""

from massspring.kernels.jit.decorators import compiled


@compiled
def tetrahedron_volumes_into(x, tetrahedra, volume):
    """V_t = (1/6) (x_b − x_a) · ((x_c − x_a) × (x_d − x_a)) [m³], (k,) (eq. 2.3). Negative: inverted."""
    for t in range(tetrahedra.shape[0]):
        a, b, c, d = tetrahedra[t, 0], tetrahedra[t, 1], tetrahedra[t, 2], tetrahedra[t, 3]
        b0, b1, b2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        c0, c1, c2 = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
        d0, d1, d2 = x[d, 0] - x[a, 0], x[d, 1] - x[a, 1], x[d, 2] - x[a, 2]
        volume[t] = (b0 * (c1 * d2 - c2 * d1) + b1 * (c2 * d0 - c0 * d2) + b2 * (c0 * d1 - c1 * d0)) / 6.0


@compiled
def smallest_ratio(volume, rest_volume):
    """min_t V_t / V_t0 [1], the smallest J of linear tetrahedra (eq. 2.3); NaN where one is not a number."""
    smallest = volume[0] / rest_volume[0]
    for t in range(volume.shape[0]):
        ratio = volume[t] / rest_volume[t]
        if ratio != ratio:
            return ratio
        smallest = min(smallest, ratio)
    return smallest
