"""The volume along a straight line: an exact cubic in the length of the step (docs/theory.md, section 10)."""

import math
from typing import NamedTuple

import numpy as np

from massspring.kernels.contact.node_contact import pushed_by_into, unpushed_into
from massspring.kernels.jit.decorators import compiled
from massspring.kernels.jit.vec3 import minus, row, triple

POLISHES = 4
"""Newton steps after the closed form: each doubles the number of digits that cancellation has left."""
BEYOND = 1e-12
"""Linear step over root: below it the root is infinite but for round-off."""


class LineSearch(NamedTuple):
    """Positions at the end of a step without pressure, and their change per unit of pressure."""

    y: np.ndarray
    """y = x + dt ṽ [m], (n, 3)."""
    d: np.ndarray
    """d = dt² W̃ G, per unit of pressure [m/Pa], (n, 3)."""


@compiled
def line_into(nodes, contacts, inverse_mass, dt, line):
    """y = x + dt ṽ [m], d = dt² W̃ G [m/Pa], (n, 3) each: the step ends at y + lam d (eq. 3.4, 3.5, 10.1)."""
    unpushed_into(nodes, contacts, dt, line.y)
    pushed_by_into(contacts, inverse_mass, dt * dt, nodes.gradient, line.d)


@compiled
def volume_cubic(y, d, triangles):
    """V(y + a d) = V + a G(y)·d + a² Σ y·g(d) + a³ V[d]: the four coefficients, on a closed surface (eq. 10.1).

    y is taken relative to a node of the surface, so that no digits are lost far from the origin.
    """
    origin = row(y, triangles[0, 0])
    k0, k1, k2, k3 = 0.0, 0.0, 0.0, 0.0
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        a, b, c = minus(row(y, i), origin), minus(row(y, j), origin), minus(row(y, k), origin)
        p, q, r = row(d, i), row(d, j), row(d, k)
        k0 += triple(a, b, c)
        k1 += triple(p, b, c)
        k1 += triple(a, q, c)
        k1 += triple(a, b, r)
        k2 += triple(a, q, r)
        k2 += triple(p, b, r)
        k2 += triple(p, q, c)
        k3 += triple(p, q, r)
    return k0 / 6.0, k1 / 6.0, k2 / 6.0, k3 / 6.0


@compiled
def largest_root(b, c, e):
    """The real root of t³ + b t² + c t + e of largest modulus (Cardano; three real ones by Viète's cosines)."""
    q = (b * b - 3.0 * c) / 9.0
    r = (2.0 * b * b * b - 9.0 * b * c + 27.0 * e) / 54.0
    if r * r < q * q * q:
        root = math.sqrt(q)
        angle = math.acos(min(max(r / (root * root * root), -1.0), 1.0))
        largest = 0.0
        for turn in range(3):
            t = -2.0 * root * math.cos((angle + 2.0 * math.pi * turn) / 3.0) - b / 3.0
            if abs(t) > abs(largest):
                largest = t
        return largest
    u = -math.copysign(np.cbrt(abs(r) + math.sqrt(max(r * r - q * q * q, 0.0))), r)
    return u + (q / u if u != 0.0 else 0.0) - b / 3.0


@compiled
def nearest_root(k0, k1, k2, k3):
    """The real a nearest to 0 with k0 + k1 a + k2 a² + k3 a³ = 0; NaN where there is none (eq. 10.2).

    In t = s/a with s = −k0/k1, the linear step, it is the largest root of t³ − t² + …: never of lower degree.
    """
    if k0 == 0.0:
        return 0.0
    scale = -k0 / k1 if k1 != 0.0 else 1.0
    b, c, e = k1 * scale / k0, k2 * scale * scale / k0, k3 * scale * scale * scale / k0
    t = largest_root(b, c, e)
    left = abs(e + t * (c + t * (b + t)))
    for _ in range(POLISHES):
        slope = c + t * (2.0 * b + 3.0 * t)
        if slope == 0.0:
            break
        better = t - (e + t * (c + t * (b + t))) / slope
        now = abs(e + better * (c + better * (b + better)))
        if not now < left:
            break
        t, left = better, now
    return scale / t if abs(t) > BEYOND and math.isfinite(t) else math.nan
