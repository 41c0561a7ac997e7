"""Smooth building blocks for level functions: any unit of length, as long as it is one."""

import numpy as np


def smooth_min(a: np.ndarray, b: np.ndarray, width: float) -> np.ndarray:
    """Smooth union (a + b - sqrt((a - b)^2 + width^2)) / 2: infinitely smooth, grown by width/2 where a = b."""
    return 0.5 * (a + b - np.sqrt((a - b) ** 2 + width**2))


def smooth_max(a: np.ndarray, b: np.ndarray, width: float) -> np.ndarray:
    """Smooth intersection; the edge where a = b is rounded off by width/2."""
    return -smooth_min(-a, -b, width)


def ellipsoid(x: np.ndarray, center: tuple[float, ...], semi_axes: tuple[float, ...]) -> np.ndarray:
    """Level, shape (n,), of an ellipsoid along the axes, slope 1 on its surface: k (k - 1) / |x / a^2|, k = |x / a|."""
    scaled = (x - np.asarray(center, float)) / np.asarray(semi_axes, float)
    k = np.linalg.norm(scaled, axis=1)
    # The level is 0/0 in the very centre, where its limit is finite and negative.
    slope = np.linalg.norm(scaled / np.asarray(semi_axes, float), axis=1)
    return k * (k - 1.0) / np.maximum(slope, 1e-9 / max(semi_axes))


def groove(x: np.ndarray, start: tuple[float, ...], end: tuple[float, ...], width: float, depth: float) -> np.ndarray:
    """What to add to a level to press a groove along a segment: `depth` deep, a Gaussian of `width` across."""
    a, along = np.asarray(start, float), np.subtract(end, start).astype(float)
    t = (x - a) @ along / (along @ along)
    # The clip makes only a second derivative jump, far weaker than the grooves themselves.
    nearest = a + np.clip(t, 0.0, 1.0)[:, None] * along
    return depth * np.exp(-np.sum((x - nearest) ** 2, axis=1) / width**2)
