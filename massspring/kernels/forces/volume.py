"""Volumes inside closed surfaces and of tetrahedra, and their gradients."""

from massspring.kernels.jit.decorators import compiled, njit_inlined
from massspring.kernels.jit.vec3 import add_to, cross, dot, minus, over, plus, row, times, triple


@compiled
def enclosed_volume(x, triangles):
    """V = (1/6) Σ_f x_i · (x_j × x_k) [m³] (eq. 2.1).

    Positions are relative to a node of the surface, so that no digits are lost far from the origin.
    """
    return cone_volume(x, triangles, row(x, triangles[0, 0]))


@compiled
def volume_gradient_into(x, triangles, gradient):
    """G_i = dV/dx_i = (1/6) Σ_f∋i (x_j - x_i) × (x_k - x_i) [m²], (n, 3); returns V [m³] (eq. 2.1, 2.2).

    Around a node of a closed surface this is the sum of x_j × x_k: one area vector per triangle is enough for its three
    nodes.
    Identities: Σ G = 0, Σ x × G = 0, Σ x·G = 3 V.
    """
    gradient[:] = 0.0
    o, volume, sixth = row(x, triangles[0, 0]), 0.0, 1.0 / 6.0
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        a = row(x, i)
        n = times(sixth, cross(minus(row(x, j), a), minus(row(x, k), a)))
        volume += dot(minus(a, o), n)
        add_to(gradient, i, n)
        add_to(gradient, j, n)
        add_to(gradient, k, n)
    return volume


@compiled
def pyramid_volume(x, mass, triangles):
    """V = Σ_f (1/3) A_f n_f · (x_f − c) [m³], pyramids over the centre of mass c (eq. 10.10); closed: eq. 2.1."""
    m, first, moment = 0.0, row(x, 0), (0.0, 0.0, 0.0)
    for i in range(x.shape[0]):
        m += mass[i]
        moment = plus(moment, times(mass[i], minus(row(x, i), first)))
    return cone_volume(x, triangles, plus(first, over(moment, m)))


@njit_inlined
def cone_volume(x, triangles, o):
    """(1/6) Σ_f (x_i − o) · ((x_j − o) × (x_k − o)) [m³]."""
    six = 0.0
    for f in range(triangles.shape[0]):
        a, b, c = row(x, triangles[f, 0]), row(x, triangles[f, 1]), row(x, triangles[f, 2])
        six += triple(minus(a, o), minus(b, o), minus(c, o))
    return six / 6.0


@compiled
def cones_into(x, triangles, centre, six):
    """6 V_f = (x_i − o) · ((x_j − o) × (x_k − o)) [m³] of the cones of triangles over o = `centre` (3,), (f,)."""
    o = (centre[0], centre[1], centre[2])
    for f in range(triangles.shape[0]):
        a, b, c = row(x, triangles[f, 0]), row(x, triangles[f, 1]), row(x, triangles[f, 2])
        a, n = minus(a, o), cross(minus(b, o), minus(c, o))
        six[f] = a[0] * n[0] + a[2] * n[2] + a[1] * n[1]  # in this order replays are equal to the bit


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
