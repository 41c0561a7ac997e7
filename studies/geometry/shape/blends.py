"""Smooth building blocks for level functions. All lengths of a call have the same unit, whichever it is."""

from collections.abc import Sequence
from functools import lru_cache
from math import comb

import numpy as np


def smooth_min(a: np.ndarray, b: np.ndarray, width: float) -> np.ndarray:
    """Smooth union (a + b - sqrt((a - b)^2 + width^2)) / 2: infinitely smooth, lower by width/2 where a = b."""
    return 0.5 * (a + b - np.sqrt((a - b) ** 2 + width**2))


def local_min(a: np.ndarray, b: np.ndarray, width: float) -> np.ndarray:
    """Smooth union -k log(exp(-a / k) + exp(-b / k)), k = width/2: as round as `smooth_min`, but lower than min(a, b)
    by 0.35 width at most, and equal to it where a and b differ by a few widths, so that distances stay distances."""
    k = 0.5 * width
    return np.minimum(a, b) - k * np.log1p(np.exp(-np.abs(a - b) / k))


def smooth_max(a: np.ndarray, b: np.ndarray, width: float) -> np.ndarray:
    """Smooth intersection -smooth_min(-a, -b, width): higher by width/2 at the edge, where a = b."""
    return -smooth_min(-a, -b, width)


def ellipsoid(x: np.ndarray, center: tuple[float, ...], semi_axes: tuple[float, ...]) -> np.ndarray:
    """Level k (k - 1) / |x / a^2|, k = |x / a|, shape (n,), of an ellipsoid with semi-axes a along x, y, z at x (n, 3);
    its slope on the surface is 1."""
    scaled = (x - np.asarray(center, float)) / np.asarray(semi_axes, float)
    k = np.linalg.norm(scaled, axis=1)
    # The lower bound avoids 0/0 at the centre.
    slope = np.linalg.norm(scaled / np.asarray(semi_axes, float), axis=1)
    return k * (k - 1.0) / np.maximum(slope, 1e-9 / max(semi_axes))


def groove(x: np.ndarray, start: tuple[float, ...], end: tuple[float, ...], width: float, depth: float) -> np.ndarray:
    """Term, shape (n,), that adds a groove along a segment to a level: depth exp(-d^2 / width^2), d the distance of
    x (n, 3) from the segment."""
    a, along = np.asarray(start, float), np.subtract(end, start).astype(float)
    t = (x - a) @ along / (along @ along)
    # The clip makes only the second derivative jump, by much less than the groove itself curves the surface.
    nearest = a + np.clip(t, 0.0, 1.0)[:, None] * along
    return depth * np.exp(-np.sum((x - nearest) ** 2, axis=1) / width**2)


Sphere = tuple[float, float, float, float]
"""Centre and radius."""
STARTS, STEPS, BATCH = 17, 40, 4096
"""Values of s tried before Newton's method; its largest number of steps (4 to 6 are usual, bisection alone needs 30);
points in a batch, few enough to stay in the cache."""
FLAT = 1e-6
"""Step of s at which the search ends. f is stationary there, so its error is of the order of the square of this."""


def canal(x: np.ndarray, spheres: Sequence[Sphere]) -> np.ndarray:
    """Signed distance f, shape (n,), of x (n, 3) to a canal surface, the envelope of spheres: min over s of |x - c(s)|
    - r(s), negative inside (Monge, Application de l'analyse a la geometrie, 1807).

    (c, r)(s), 0 <= s <= 1, is the Bezier curve of the control `spheres`. |grad f| = 1 wherever the nearest s is unique,
    so a wall between f = 0 and f = -w has the thickness w everywhere. An end is round and infinitely smooth if the last
    control sphere lies well inside the one before it (`closed` adds such spheres).
    """
    table, x = _table(tuple(spheres)), np.asarray(x, float)
    return np.concatenate([np.empty(0), *(_nearest(x[k : k + BATCH], table) for k in range(0, len(x), BATCH))])


@lru_cache
def _table(spheres: tuple[Sphere, ...]) -> np.ndarray:
    """Coefficients of s^0, s^1, ... of (c, r)(s) and of its first two derivatives, shape (k, 12) for k spheres."""
    rows = _powers(np.asarray(spheres, float))
    first = _derivative(rows)
    return np.hstack([rows, first, _derivative(first)])


def _nearest(x: np.ndarray, table: np.ndarray) -> np.ndarray:
    """min over s of |x - c(s)| - r(s), shape (n,): the best of STARTS values, then Newton's method in a bracket."""
    starts = np.linspace(0.0, 1.0, STARTS)
    at = _monomials(starts, len(table)) @ table[:, :4]
    square = (x**2).sum(axis=1)[:, None] - 2.0 * x @ at[:, :3].T + (at[:, :3] ** 2).sum(axis=1)
    s = starts[(np.sqrt(np.maximum(square, 0.0)) - at[:, 3]).argmin(axis=1)]
    low, high = np.maximum(s - starts[1], 0.0), np.minimum(s + starts[1], 1.0)
    for _ in range(STEPS):
        at = _monomials(s, len(table)) @ table
        d, rate, bend = x - at[:, :3], at[:, 4:7], at[:, 8:11]
        length = np.maximum(np.sqrt(np.einsum("ij,ij->i", d, d)), 1e-12)
        along = np.einsum("ij,ij->i", d, rate) / length
        slope = -along - at[:, 7]
        curved = (np.einsum("ij,ij->i", rate, rate) - np.einsum("ij,ij->i", d, bend) - along**2) / length - at[:, 11]
        low, high = np.where(slope < 0, s, low), np.where(slope > 0, s, high)
        step = s - slope / np.where(curved > 0, curved, 1.0)
        # Bisection where the curvature is not positive, or where Newton's step leaves the bracket of the minimum.
        new = np.where((step >= low) & (step <= high) & (curved > 0), step, 0.5 * (low + high))
        moved, s = np.abs(new - s).max(), new
        if moved < FLAT:
            break
    at = _monomials(s, len(table)) @ table[:, :4]
    return np.linalg.norm(x - at[:, :3], axis=1) - at[:, 3]


def closed(spheres: Sequence[Sphere]) -> list[Sphere]:
    """The control spheres and one more inside each end sphere, so that the canal surface closes smoothly there."""
    rows = np.asarray(spheres, float)

    def cap(last: np.ndarray, before: np.ndarray) -> Sphere:
        along = (last - before)[:3] / np.linalg.norm((last - before)[:3])
        x, y, z = last[:3] + 0.1 * last[3] * along
        return float(x), float(y), float(z), float(0.8 * last[3])

    return [cap(rows[0], rows[1]), *spheres, cap(rows[-1], rows[-2])]


def _powers(control: np.ndarray) -> np.ndarray:
    """Coefficients of s^0, s^1, ... of the Bezier curve of control points (k, 4), shape (k, 4)."""
    degree = len(control) - 1
    rows = []
    for j in range(degree + 1):
        terms = [(-1.0) ** (i + j) * comb(j, i) * control[i] for i in range(j + 1)]
        rows.append(comb(degree, j) * np.sum(terms, axis=0))
    return np.array(rows)


def _derivative(coefficients: np.ndarray) -> np.ndarray:
    """Coefficients of the derivative, padded with a row of zeros to the same shape."""
    factors = np.arange(1, len(coefficients))[:, None]
    return np.vstack([factors * coefficients[1:], np.zeros(coefficients.shape[1])])


def _monomials(s: np.ndarray, count: int) -> np.ndarray:
    """1, s, s^2, ..., shape (n, count)."""
    powers = np.ones((len(s), count))
    for k in range(1, count):
        np.multiply(powers[:, k - 1], s, out=powers[:, k])
    return powers
