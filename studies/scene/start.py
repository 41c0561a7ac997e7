"""How a body starts that is not at rest."""

from dataclasses import dataclass

import numpy as np

from studies.scene.placing import Vector


@dataclass(frozen=True)
class InitialConditions:
    """How a body starts that is not at rest. A shape is for the mass-spring solver alone, a speed for both."""

    matrix: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    """Linear map of the rest positions about the middle of their box [1], row by row."""
    scatter: float = 0.0
    """Half the edge of the cube in which every node is displaced at random, over half the longest side of the box
    [1]."""

    speed: tuple[Vector, Vector, Vector] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    """Linear map from rest positions about the origin to velocities [1/s], row by row; the trace must be 0, since an
    incompressible body cannot swell."""

    def velocities(self, rest: np.ndarray) -> np.ndarray | None:
        """Initial velocities (n, 3) [m/s]; None if all are 0."""
        return rest @ np.asarray(self.speed).T if np.any(self.speed) else None

    @property
    def shaped(self) -> bool:
        """Whether it starts in a shape other than that at rest."""
        return self.scatter != 0.0 or not np.array_equal(self.matrix, np.eye(3))

    def positions(self, rest: np.ndarray) -> np.ndarray:
        """Initial positions (n, 3) [m]; the random displacements are always the same."""
        low, high = rest.min(axis=0), rest.max(axis=0)
        thrown = np.random.default_rng(0).uniform(-1.0, 1.0, rest.shape) * 0.5 * (high - low).max()
        middle = 0.5 * (low + high)
        return middle + (rest - middle) @ np.asarray(self.matrix).T + self.scatter * thrown
