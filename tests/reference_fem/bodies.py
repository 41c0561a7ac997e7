"""Small bodies for the tests, those of the oracles; and the potential of contact, independent of its kernel."""

import numpy as np

from reference_fem.contact.augmented import Touch
from reference_fem.elements.surface import Surface, point_positions
from reference_fem.model.obstacles import gaps
from reference_fem.oracles.bodies import ball_octant, block, on_radius, shell_octant, symmetry, whole_ball

__all__ = ["ball_octant", "block", "contact_potential", "on_radius", "shell_octant", "symmetry", "whole_ball"]


def contact_potential(x: np.ndarray, surface: Surface, touch: Touch):
    """sum w (t² - m² + T² - m_T²) / (2 eps) [J] in plain NumPy."""
    y, total, eps = point_positions(x, surface), 0.0, touch.penalty[:, None]
    for o, (row, m) in enumerate(zip(touch.rows, touch.multiplier, strict=True)):
        t = np.maximum(0.0, m - eps * gaps(row, y))
        total += np.sum(surface.weights * (t**2 - m**2) / (2.0 * eps))
        if o < len(touch.grip.stuck):
            anchor, hold = touch.grip.anchor[o], touch.grip.traction[o]
            slip = y - row[1:4] - anchor
            ahead = np.stack([gaps(row, row[1:4] + anchor + 1e-6 * e) for e in np.eye(3)], axis=-1)
            behind = np.stack([gaps(row, row[1:4] + anchor - 1e-6 * e) for e in np.eye(3)], axis=-1)
            n = (ahead - behind) / 2e-6
            slip = slip - np.sum(slip * n, axis=-1, keepdims=True) * n
            share = np.sum((hold - eps[..., None] * slip) ** 2 - hold**2, axis=-1) / (2.0 * eps)
            total += np.sum(surface.weights * share, where=touch.grip.stuck[o] & (t > 0.0))
    return float(total)
