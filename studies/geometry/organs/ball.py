"""Ball: the shape for which closed-form solutions exist."""

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.shape.levelset import Shape


def ball_shape(radius: float = 0.05, wall: float | None = None) -> Shape:
    """Ball of the given radius [m] around the origin, hollow with a wall [m].

    Raises StudyError unless 0 < radius < inf and, for a hollow ball, 0 < wall < radius.
    """
    if not 0 < radius < np.inf:
        raise StudyError(f"a ball of radius {radius} m cannot be meshed; give a radius above 0")
    if wall is not None and not 0 < wall < radius:
        raise StudyError(f"a wall of {wall} m does not fit into a ball of radius {radius} m; choose one under that")
    reach = 1.2 * radius
    return Shape(
        name="ball",
        level=lambda points: np.linalg.norm(points, axis=1) - radius,
        low=(-reach, -reach, -reach),
        high=(reach, reach, reach),
        cell=radius / 8.0,
        wall=wall,
    )


def project_ball(points: np.ndarray, radius: float = 0.05) -> np.ndarray:
    """Nearest points to points (n, 3) [m] on the sphere of the given radius [m] around the origin, shape (n, 3) [m]."""
    return points * (radius / np.linalg.norm(points, axis=1, keepdims=True))
