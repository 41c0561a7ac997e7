"""Angular springs: the angle between two edges at a node, its energy and forces (docs/theory.md, eq. 14.5, 14.6)."""

import math
from typing import NamedTuple

import numpy as np

from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import njit_lean

STRAIGHT = 1e-12
"""Sine below which an angle counts as 0 or π: its gradient then has no direction."""


@by_address
class Angles(NamedTuple):
    """a angles at nodes."""

    corner: np.ndarray
    """First end, apex and second end, (a, 3) int64."""
    rest: np.ndarray
    """[rad], (a,)."""
    stiffness: np.ndarray
    """κ [N m], (a,)."""


@njit_lean
def opening(x, i, apex, j):
    """(θ, sin θ, cos θ) of the angle between the edges from `apex` to i and j, and their lengths [m]; NaN if an edge
    has no length."""
    a0, a1, a2 = x[i, 0] - x[apex, 0], x[i, 1] - x[apex, 1], x[i, 2] - x[apex, 2]
    b0, b1, b2 = x[j, 0] - x[apex, 0], x[j, 1] - x[apex, 1], x[j, 2] - x[apex, 2]
    c0, c1, c2 = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    across, along = math.sqrt(c0 * c0 + c1 * c1 + c2 * c2), a0 * b0 + a1 * b1 + a2 * b2
    la, lb = math.sqrt(a0 * a0 + a1 * a1 + a2 * a2), math.sqrt(b0 * b0 + b1 * b1 + b2 * b2)
    return math.atan2(across, along), across / (la * lb), along / (la * lb), la, lb


@njit_lean
def angle_energy(x, angles):
    """U = Σ ½ κ (θ − θ0)² [J] (eq. 14.5)."""
    energy = 0.0
    for k in range(angles.rest.shape[0]):
        theta, _, _, _, _ = opening(x, angles.corner[k, 0], angles.corner[k, 1], angles.corner[k, 2])
        energy += 0.5 * angles.stiffness[k] * (theta - angles.rest[k]) ** 2
    return energy


@njit_lean
def angle_forces_into(x, angles, force):
    """f = −κ (θ − θ0) ∂θ/∂x [N], (n, 3), ∂θ/∂x_i = (cos θ â − b̂)/(|a| sin θ) (eq. 14.6).

    An angle of 0 or π has no direction to bend in and gives no force. Internal: forces and moments sum to zero.
    """
    force[:] = 0.0
    for k in range(angles.rest.shape[0]):
        i, apex, j = angles.corner[k, 0], angles.corner[k, 1], angles.corner[k, 2]
        theta, sine, cosine, la, lb = opening(x, i, apex, j)
        if sine < STRAIGHT:
            continue
        moment = -angles.stiffness[k] * (theta - angles.rest[k]) / sine
        for axis in range(3):
            a, b = (x[i, axis] - x[apex, axis]) / la, (x[j, axis] - x[apex, axis]) / lb
            first, second = moment * (cosine * a - b) / la, moment * (cosine * b - a) / lb
            force[i, axis] += first
            force[j, axis] += second
            force[apex, axis] -= first + second
