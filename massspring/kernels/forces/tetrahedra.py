"""Volumes of tetrahedra, and their smallest ratio to the rest volumes."""

from massspring.kernels.jit.decorators import compiled
from massspring.kernels.jit.vec3 import minus, row, triple


@compiled
def tetrahedron_volumes_into(x, tetrahedra, volume):
    """V_t = (1/6) (x_b − x_a) · ((x_c − x_a) × (x_d − x_a)) [m³], (k,) (eq. 2.3). Negative: inverted."""
    for t in range(tetrahedra.shape[0]):
        o = row(x, tetrahedra[t, 0])
        b, c, d = (
            minus(row(x, tetrahedra[t, 1]), o),
            minus(row(x, tetrahedra[t, 2]), o),
            minus(row(x, tetrahedra[t, 3]), o),
        )
        volume[t] = triple(b, c, d) / 6.0


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
