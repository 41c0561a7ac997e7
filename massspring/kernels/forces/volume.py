"""The volume inside a closed surface and its gradient."""

from massspring.kernels.jit.decorators import compiled


@compiled
def enclosed_volume(x, triangles):
    """V = (1/6) Σ_f x_i · (x_j × x_k) [m³] (eq. 2.1).

    Positions are relative to a node of the surface, so that no digits are lost far from the origin.
    """
    o0, o1, o2 = x[triangles[0, 0], 0], x[triangles[0, 0], 1], x[triangles[0, 0], 2]
    six = 0.0
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        a0, a1, a2 = x[i, 0] - o0, x[i, 1] - o1, x[i, 2] - o2
        b0, b1, b2 = x[j, 0] - o0, x[j, 1] - o1, x[j, 2] - o2
        c0, c1, c2 = x[k, 0] - o0, x[k, 1] - o1, x[k, 2] - o2
        six += a0 * (b1 * c2 - b2 * c1) + a1 * (b2 * c0 - b0 * c2) + a2 * (b0 * c1 - b1 * c0)
    return six / 6.0


@compiled
def volume_gradient_into(x, triangles, gradient):
    """G_i = dV/dx_i = (1/6) Σ_f∋i (x_j - x_i) × (x_k - x_i) [m²], (n, 3); returns V [m³] (eq. 2.1, 2.2).

    Around a node of a closed surface this is the sum of x_j × x_k: one area vector per triangle is enough for its three
    nodes.
    Identities: Σ G = 0, Σ x × G = 0, Σ x·G = 3 V.
    """
    gradient[:] = 0.0
    o0, o1, o2 = x[triangles[0, 0], 0], x[triangles[0, 0], 1], x[triangles[0, 0], 2]
    volume = 0.0
    sixth = 1.0 / 6.0
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        a0, a1, a2 = x[i, 0], x[i, 1], x[i, 2]
        b0, b1, b2 = x[j, 0] - a0, x[j, 1] - a1, x[j, 2] - a2
        c0, c1, c2 = x[k, 0] - a0, x[k, 1] - a1, x[k, 2] - a2
        n0, n1, n2 = sixth * (b1 * c2 - b2 * c1), sixth * (b2 * c0 - b0 * c2), sixth * (b0 * c1 - b1 * c0)
        volume += (a0 - o0) * n0 + (a1 - o1) * n1 + (a2 - o2) * n2
        gradient[i, 0] += n0
        gradient[i, 1] += n1
        gradient[i, 2] += n2
        gradient[j, 0] += n0
        gradient[j, 1] += n1
        gradient[j, 2] += n2
        gradient[k, 0] += n0
        gradient[k, 1] += n1
        gradient[k, 2] += n2
    return volume


@compiled
def pyramid_volume(x, mass, triangles):
    """V = Σ_f (1/3) A_f n_f · (x_f − c) [m³], pyramids over the centre of mass c (eq. 10.10); closed: eq. 2.1."""
    m, o0, o1, o2 = 0.0, 0.0, 0.0, 0.0
    for i in range(x.shape[0]):
        m += mass[i]
        o0 += mass[i] * (x[i, 0] - x[0, 0])
        o1 += mass[i] * (x[i, 1] - x[0, 1])
        o2 += mass[i] * (x[i, 2] - x[0, 2])
    o0, o1, o2 = x[0, 0] + o0 / m, x[0, 1] + o1 / m, x[0, 2] + o2 / m
    six = 0.0
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        a0, a1, a2 = x[i, 0] - o0, x[i, 1] - o1, x[i, 2] - o2
        b0, b1, b2 = x[j, 0] - o0, x[j, 1] - o1, x[j, 2] - o2
        c0, c1, c2 = x[k, 0] - o0, x[k, 1] - o1, x[k, 2] - o2
        six += a0 * (b1 * c2 - b2 * c1) + a1 * (b2 * c0 - b0 * c2) + a2 * (b0 * c1 - b1 * c0)
    return six / 6.0
