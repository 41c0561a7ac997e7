"""Rigid, frictionless obstacles and attachments that move along prescribed paths."""

from dataclasses import dataclass

import numpy as np

from massspring.errors import MassSpringError


@dataclass(frozen=True)
class Path:
    """Displacement over time, straight between key positions and still outside them."""

    times: tuple[float, ...] = (0.0,)
    """[s], ascending."""
    displacements: tuple[tuple[float, float, float], ...] = ((0.0, 0.0, 0.0),)
    """[m] from the position at rest, one per time."""

    def __post_init__(self) -> None:
        if len(self.times) != len(self.displacements) or not self.times:
            raise MassSpringError(
                f"a path has {len(self.times)} times for {len(self.displacements)} displacements; give one each"
            )
        if not (np.isfinite(self.times).all() and np.isfinite(self.displacements).all()):
            raise MassSpringError("a path holds values that are not finite; give numbers in seconds and metres")
        if (np.diff(self.times) <= 0).any():
            raise MassSpringError(f"the times of a path are {self.times} s; they must ascend")

    def __call__(self, t: float | np.ndarray) -> np.ndarray:
        """Displacement [m] at time(s) `t` [s], (3,) or (q, 3)."""
        keys = np.asarray(self.displacements)
        return np.stack([np.interp(t, self.times, keys[:, axis]) for axis in range(3)], axis=-1)


STILL = Path()


def _unit(name: str, vector: tuple[float, float, float]) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    if not (np.isfinite(length) and length > 0):
        raise MassSpringError(f"the {name} is {vector}; it needs a direction")
    return np.asarray(vector) / length


@dataclass(frozen=True)
class Plane:
    """The body stays where n·(x − point) ≥ 0."""

    point: tuple[float, float, float]
    """[m], at path displacement 0."""
    normal: tuple[float, float, float]
    """Towards the body; any length."""
    path: Path = STILL

    def __post_init__(self) -> None:
        _unit("plane normal", self.normal)
        if not np.isfinite(self.point).all():
            raise MassSpringError(f"the plane goes through {self.point}; give finite metres")

    @property
    def unit_normal(self) -> np.ndarray:
        """(3,)."""
        return _unit("plane normal", self.normal)

    def gap(self, points: np.ndarray, t: float) -> np.ndarray:
        """Signed distance [m] of `points` (n, 3) at time `t`, negative inside the obstacle, (n,)."""
        return (points - (np.asarray(self.point) + self.path(t))) @ self.unit_normal


@dataclass(frozen=True)
class Sphere:
    """The body stays outside."""

    centre: tuple[float, float, float]
    """[m], at path displacement 0."""
    radius: float
    """[m]."""
    path: Path = STILL

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius) and self.radius > 0):
            raise MassSpringError(f"the sphere has radius {self.radius} m; it must be positive")
        if not np.isfinite(self.centre).all():
            raise MassSpringError(f"the sphere lies at {self.centre}; give finite metres")

    def gap(self, points: np.ndarray, t: float) -> np.ndarray:
        """Signed distance [m] of `points` (n, 3) at time `t`, negative inside the obstacle, (n,)."""
        return np.linalg.norm(points - (np.asarray(self.centre) + self.path(t)), axis=1) - self.radius


Obstacle = Plane | Sphere


@dataclass(frozen=True, eq=False)
class Attachment:
    """Nodes whose motion is prescribed."""

    nodes: np.ndarray
    """Node indices, (h,)."""
    path: Path = STILL
