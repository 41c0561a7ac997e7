"""Vectors of three components in kernels: tuples, of numbers or of vector registers (kernels.jit.vectors).

Sums run over x, y, z in this order everywhere: a result depends on it in its last bits.
"""

from massspring.kernels.jit.decorators import njit_inlined


@njit_inlined
def row(table, i):
    """The first three numbers in row i."""
    return table[i, 0], table[i, 1], table[i, 2]


@njit_inlined
def put(table, i, a):
    """Row i becomes a."""
    table[i, 0], table[i, 1], table[i, 2] = a[0], a[1], a[2]


@njit_inlined
def add_to(table, i, a):
    """Row i += a."""
    table[i, 0] += a[0]
    table[i, 1] += a[1]
    table[i, 2] += a[2]


@njit_inlined
def take_from(table, i, a):
    """Row i −= a."""
    table[i, 0] -= a[0]
    table[i, 1] -= a[1]
    table[i, 2] -= a[2]


@njit_inlined
def plus(a, b):
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@njit_inlined
def minus(a, b):
    """a − b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit_inlined
def times(factor, a):
    """The components times one number."""
    return factor * a[0], factor * a[1], factor * a[2]


@njit_inlined
def over(a, divisor):
    """The components divided by one number."""
    return a[0] / divisor, a[1] / divisor, a[2] / divisor


@njit_inlined
def dot(a, b):
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit_inlined
def cross(a, b):
    """a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit_inlined
def triple(a, b, c):
    """a · (b × c)."""
    return dot(a, cross(b, c))
