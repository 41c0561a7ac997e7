"""Exact decisions on which side a point lies: floating point first, integers where its error bound does not suffice."""

from collections.abc import Callable, Sequence

import numpy as np

BOUND_3, BOUND_2 = 7.8e-16, 3.4e-16
"""Upper bounds of the rounding of the determinants in three and two dimensions, relative to the sum of the absolute
values of the products (Shewchuk 1997, Adaptive precision floating-point arithmetic and fast robust geometric
predicates, bounds A)."""


def orientation(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Sign of det(a - d, b - d, c - d), shape (n,) int, for points (n, 3): 1 if d lies below the plane of a, b, c,
    which are anticlockwise seen from above, and 0 exactly in the plane."""
    u, v, w = a - d, b - d, c - d
    positive = [u[:, i] * v[:, j] * w[:, k] for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
    negative = [u[:, i] * v[:, j] * w[:, k] for i, j, k in ((2, 1, 0), (1, 0, 2), (0, 2, 1))]
    value = np.asarray(sum(positive) - sum(negative))
    return decided(value, BOUND_3, positive + negative, (a, b, c, d), exact_3)


def orientation_2(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Sign of det(a - c, b - c), shape (n,) int, for points (n, 2): 1 if a, b, c are anticlockwise."""
    u, v = a - c, b - c
    products = [u[:, 0] * v[:, 1], u[:, 1] * v[:, 0]]
    return decided(products[0] - products[1], BOUND_2, products, (a, b, c), exact_2)


def decided(
    value: np.ndarray,
    bound: float,
    products: Sequence[np.ndarray],
    corners: Sequence[np.ndarray],
    exact: Callable[..., np.ndarray],
) -> np.ndarray:
    """Signs of the determinants `value` (n,), decided by `exact` where twice the rounding error may exceed them."""
    doubtful = np.abs(value) < 2.0 * bound * sum(np.abs(product) for product in products)
    sign = np.sign(value).astype(int)
    if doubtful.any():
        sign[doubtful] = exact(*whole_numbers([corner[doubtful] for corner in corners]))
    return sign


def whole_numbers(arrays: list[np.ndarray]) -> list[np.ndarray]:
    """The coordinates as Python integers, all multiplied by the same power of two."""
    parts = [np.frexp(array) for array in arrays]
    least = min(int(exponent.min()) for _, exponent in parts)
    scaled = []
    for mantissa, exponent in parts:
        whole = (mantissa * 2.0**53).astype(np.int64).astype(object)
        scaled.append(whole * np.array([1 << int(e) for e in (exponent - least).ravel()], object).reshape(whole.shape))
    return scaled


def exact_3(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Signs of det(a - d, b - d, c - d) for integer coordinates (n, 3)."""
    (ux, uy, uz), (vx, vy, vz), (wx, wy, wz) = (a - d).T, (b - d).T, (c - d).T
    value = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
    return (value > 0).astype(int) - (value < 0).astype(int)


def exact_2(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Signs of det(a - c, b - c) for integer coordinates (n, 2)."""
    (ux, uy), (vx, vy) = (a - c).T, (b - c).T
    value = ux * vy - uy * vx
    return (value > 0).astype(int) - (value < 0).astype(int)
