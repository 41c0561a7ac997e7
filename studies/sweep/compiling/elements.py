"""The reference's kernels, run on a few elements: contact, a lumen, a motion."""

import numpy as np

from reference_fem import (
    Cavity,
    DynamicsSettings,
    NeoHookean,
    PrescribedDisplacement,
    Problem,
    RigidPlane,
    RigidSphere,
    equilibrium_path,
    motion_path,
)
from reference_fem.oracles.bodies import block, shell_octant, symmetry

SOFT = NeoHookean(1.0, 500.0)
HELD = (PrescribedDisplacement(lambda x: x[2] < 1e-9),)
INNER = 0.5
"""Radius of the lumen over that of the shell [1]."""


def press() -> None:
    """A unit cube under a plane and next to a sphere that holds what it touches."""
    obstacles = (
        RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, -0.02 * t)),
        RigidSphere((1.5, 0.5, 0.5), 0.5, lambda t: (-0.02 * t, 0.0, 0.0), slip="no_slip"),
    )
    equilibrium_path(Problem(block((2, 2, 2)), SOFT, HELD, obstacles), [1.0])


def inflate() -> None:
    """An eighth of a thick shell, filled by 1 % more."""
    lumen = Cavity(lambda x: np.linalg.norm(x, axis=0) < 1.05 * INNER, volume=lambda t: 1.0 + 0.01 * t)
    equilibrium_path(Problem(shell_octant(INNER, 2, 1), SOFT, symmetry(), cavities=(lumen,)), [1.0])


def move() -> None:
    """A cube that is thrown against a plane."""
    plane = RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0))
    problem = Problem(block((2, 2, 2)), SOFT, HELD, (plane,), density=1.0)
    motion_path(problem, (0.01, 0.02), DynamicsSettings(damping=0.1), (0.0, 0.0, 0.1))


TASKS = {
    "reference, contact": press,
    "reference, lumen": inflate,
    "reference, motion": move,
}
"""Name -> what compiles it."""
