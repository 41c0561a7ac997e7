"""An organ as a level function, f(x) < 0 inside and f(x) = 0 on its surface, and the projection onto the surface."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.shape.regions import KnownRegion, Vector

Level = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Literature:
    """Volume [mL] of an adult's organ from a textbook or a patient series; for a hollow organ that of its content."""

    volume_ml: float
    source: str


@dataclass(frozen=True)
class PalpationPoint:
    """A smooth, freely reachable surface point [m] and the outward unit normal there; a probe moves against the
    normal."""

    point: Vector
    normal: Vector


@dataclass(frozen=True, eq=False)
class Shape:
    """The true shape of an organ.

    level: f(points (n, 3) [m]) -> (n,) [m], negative inside, smooth near its zero set, |grad f| of order 1
    low, high: corners [m] of a box around the organ, which leaves more than one cell on every side
    cell: edge [m] of the grid on which f is first sampled; smaller than the thinnest part
    regions: default attachments
    wall: thickness [m] of the wall of a hollow organ, whose lumen is bounded by f = -wall; None for a solid organ
    literature: the volume that the default parameters have to match, with its source
    probe, press: where an instrument palpates, and the unit vector along which a plane presses; None if there is none
    """

    name: str
    level: Level
    low: Vector
    high: Vector
    cell: float
    regions: Mapping[str, KnownRegion] = field(default_factory=dict)
    wall: float | None = None
    literature: Literature | None = None
    probe: PalpationPoint | None = None
    press: Vector | None = None

    @property
    def size(self) -> float:
        """Diagonal of the box [m]."""
        return float(np.linalg.norm(np.subtract(self.high, self.low)))


def at_depth(shape: Shape, depth: float) -> Shape:
    """The body inside f = -depth [m]; with depth = wall it is the lumen of a hollow organ."""
    return replace(shape, level=lambda points: shape.level(points) + depth)


def gradient(level: Level, points: np.ndarray, step: float) -> np.ndarray:
    """Gradient of f at points (n, 3) by central differences, shape (n, 3); `step` in the unit of the points."""
    count = len(points)
    shifts = step * np.vstack([np.eye(3), -np.eye(3)])
    values = level((points[None, :, :] + shifts[:, None, :]).reshape(-1, 3)).reshape(6, count)
    return (values[:3] - values[3:]).T / (2.0 * step)


def normals(shape: Shape, points: np.ndarray) -> np.ndarray:
    """Outward unit normals, shape (n, 3), of the level surfaces at points (n, 3) [m]."""
    rows = gradient(shape.level, points, 1e-6 * shape.size)
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


STALE = 0.05
"""If a step leaves more than this share of the residual, the next step computes new gradients."""
STEPS = 60


def project(
    shape: Shape, points: np.ndarray, constraints: tuple[Level, ...] = (), within: float | None = None
) -> np.ndarray:
    """Points (n, 3) [m] projected onto f = 0, and onto g = 0 for every further constraint g, shape (n, 3) [m].

    Newton's method takes the smallest correction, d = -A^T (A A^T)^-1 r with the gradients as rows of A, which it keeps
    as long as the residual falls fast (chord method). within: residual [m] at which a point stays; None: 1e-13 of the
    size of the box. Raises StudyError if it does not converge: far from the surface, or where the constraints do not
    meet.
    """
    x = np.array(points, float)
    levels = (shape.level, *constraints)
    tolerance = 1e-13 * shape.size if within is None else within
    residual = np.stack([level(x) for level in levels], axis=1)
    rows = np.zeros((len(x), len(levels), 3))
    stale = np.ones(len(x), bool)
    moving = np.flatnonzero(np.abs(residual).max(axis=1, initial=0.0) > tolerance)
    for _ in range(STEPS):
        if not len(moving):
            return x
        new = moving[stale[moving]]
        if len(new):
            # Forward differences suffice, because the residual decides where the points end.
            step = 1e-6 * shape.size
            shifted = (x[new][None, :, :] + step * np.eye(3)[:, None, :]).reshape(-1, 3)
            ahead = np.stack([level(shifted).reshape(3, len(new)) for level in levels], axis=2)
            rows[new] = (ahead - residual[new][None]).transpose(1, 2, 0) / step
        a, r = rows[moving], residual[moving]
        gram = a @ a.transpose(0, 2, 1) + 1e-12 * np.eye(len(levels))
        d = -(a.transpose(0, 2, 1) @ np.linalg.solve(gram, r[:, :, None]))[:, :, 0]
        # A step longer than a cell leaves the neighbourhood in which the gradient is valid.
        d *= np.minimum(1.0, shape.cell / np.maximum(np.linalg.norm(d, axis=1), 1e-300))[:, None]
        x[moving] += d
        residual[moving] = np.stack([level(x[moving]) for level in levels], axis=1)
        left = np.abs(residual[moving]).max(axis=1)
        stale[moving] = left > STALE * np.abs(r).max(axis=1)
        moving = moving[left > tolerance]
    worst = np.abs(residual).max()
    raise StudyError(
        f"{shape.name}: points could not be brought onto the surface (still {worst:.2g} m away); start nearer to it"
    )
