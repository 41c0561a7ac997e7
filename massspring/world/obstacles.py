"""Rigid obstacles and attachments that move along prescribed paths."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from massspring.errors import MassSpringError
from massspring.world.trajectories import STILL, Trajectory


def _unit(name: str, vector: tuple[float, float, float]) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    if not (np.isfinite(length) and length > 0):
        raise MassSpringError(f"the {name} is {vector}; it needs a direction")
    return np.asarray(vector) / length


Friction = float | Literal["no_slip"]
"""Coulomb's coefficient [1]; 0: frictionless; "no_slip": what touches moves with the obstacle."""


def _check_friction(friction: Friction) -> None:
    if friction != "no_slip" and not (isinstance(friction, int | float) and np.isfinite(friction) and friction >= 0):
        raise MassSpringError(f"the friction is {friction!r}; give a coefficient from 0 on, or 'no_slip'")


@dataclass(frozen=True)
class Plane:
    """The body stays where n·(x − point) ≥ 0."""

    point: tuple[float, float, float]
    """[m], at path displacement 0."""
    normal: tuple[float, float, float]
    """Towards the body; any length."""
    path: Trajectory = STILL
    friction: Friction = 0.0

    def __post_init__(self) -> None:
        _unit("plane normal", self.normal)
        _check_friction(self.friction)
        if not np.isfinite(self.point).all():
            raise MassSpringError(f"the plane goes through {self.point}; give finite metres")

    @property
    def anchor(self) -> np.ndarray:
        """What the path moves [m], (3,)."""
        return np.asarray(self.point, dtype=np.float64)

    @cached_property
    def unit_normal(self) -> np.ndarray:
        """(3,)."""
        return _unit("plane normal", self.normal)

    def gap(self, points: np.ndarray, t: float) -> np.ndarray:
        """Signed distance [m] of `points` (n, 3) at time `t`, negative inside the obstacle, (n,)."""
        return np.einsum("ij,j->i", points - (self.anchor + self.path(t)), self.unit_normal)


@dataclass(frozen=True)
class Sphere:
    """The body stays outside."""

    centre: tuple[float, float, float]
    """[m], at path displacement 0."""
    radius: float
    """[m]."""
    path: Trajectory = STILL
    friction: Friction = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius) and self.radius > 0):
            raise MassSpringError(f"the sphere has radius {self.radius} m; it must be positive")
        if not np.isfinite(self.centre).all():
            raise MassSpringError(f"the sphere lies at {self.centre}; give finite metres")
        _check_friction(self.friction)

    @property
    def anchor(self) -> np.ndarray:
        """What the path moves [m], (3,)."""
        return np.asarray(self.centre, dtype=np.float64)

    def gap(self, points: np.ndarray, t: float) -> np.ndarray:
        """Signed distance [m] of `points` (n, 3) at time `t`, negative inside the obstacle, (n,)."""
        return np.linalg.norm(points - (self.anchor + self.path(t)), axis=1) - self.radius


@dataclass(frozen=True)
class Capsule:
    """A rod with round ends; the body stays outside."""

    start: tuple[float, float, float]
    """One end of the axis [m], at path displacement 0."""
    end: tuple[float, float, float]
    """The other [m]."""
    radius: float
    """[m]."""
    path: Trajectory = STILL
    friction: Friction = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius) and self.radius > 0):
            raise MassSpringError(f"the capsule has radius {self.radius} m; it must be positive")
        if not (np.isfinite(self.start).all() and np.isfinite(self.end).all()):
            raise MassSpringError(f"the capsule reaches from {self.start} to {self.end}; give finite metres")
        if tuple(self.start) == tuple(self.end):
            raise MassSpringError(f"the capsule starts and ends at {self.start}; give it a length, or use a sphere")
        _check_friction(self.friction)

    @property
    def anchor(self) -> np.ndarray:
        """What the path moves [m], (3,)."""
        return np.asarray(self.start, dtype=np.float64)

    @property
    def span(self) -> np.ndarray:
        """From start to end [m], (3,)."""
        return np.asarray(self.end, dtype=np.float64) - self.anchor

    def gap(self, points: np.ndarray, t: float) -> np.ndarray:
        """Signed distance [m] of `points` (n, 3) at time `t`, negative inside the obstacle, (n,)."""
        from_start = points - (self.anchor + self.path(t))
        share = np.clip(np.einsum("ij,j->i", from_start, self.span) / (self.span @ self.span), 0.0, 1.0)
        return np.linalg.norm(from_start - share[:, None] * self.span, axis=1) - self.radius


@dataclass(frozen=True)
class Probe:
    """The tip of a thin probe: a point, or a ball thinner than a triangle, that no triangle passes however fast it is.

    A sphere or capsule touches nodes, between which something thin would slip; a probe touches triangles, in
    continuous time and from either side, without friction. Its shaft touches nothing.
    """

    tip: tuple[float, float, float]
    """[m], at path displacement 0."""
    radius: float = 0.0
    """[m]; the surface stays this far from the tip, and a little off a tip without thickness."""
    path: Trajectory = STILL

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius) and self.radius >= 0):
            raise MassSpringError(f"the probe has radius {self.radius} m; it must be zero or positive")
        if not np.isfinite(self.tip).all():
            raise MassSpringError(f"the tip of the probe lies at {self.tip}; give finite metres")

    @property
    def anchor(self) -> np.ndarray:
        """What the path moves [m], (3,)."""
        return np.asarray(self.tip, dtype=np.float64)

    def gap(self, points: np.ndarray, t: float) -> np.ndarray:
        """Signed distance [m] of `points` (n, 3) at time `t`, negative inside the obstacle, (n,)."""
        return np.linalg.norm(points - (self.anchor + self.path(t)), axis=1) - self.radius


Obstacle = Plane | Sphere | Capsule | Probe


@dataclass(frozen=True, eq=False)
class Attachment:
    """Nodes whose motion is prescribed."""

    nodes: np.ndarray
    """Node indices, (h,)."""
    path: Trajectory = STILL


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Obstacles, what is held, loads and the start of a run."""

    obstacles: tuple[Obstacle, ...] = ()
    attachments: int = 0
    """How many."""
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """[m/s²]."""
    targets: bool = False
    """Whether a target is given for a kept volume."""
    moved: bool = False
    """Whether the body starts with velocities, or in another shape than at rest."""

    @property
    def rough(self) -> bool:
        """Whether an obstacle has friction."""
        return any(getattr(obstacle, "friction", 0.0) != 0.0 for obstacle in self.obstacles)
