"""Rigid obstacles: planes, spheres and capsules that move by a prescribed path, and their gap to a point."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from reference_fem.compiled import compiled
from reference_fem.errors import SolveError

PLANE, SPHERE, CAPSULE = 0, 1, 2
SLIP = ("frictionless", "no_slip")


def finite_vector(value: ArrayLike, name: str):
    """Three finite numbers as an array; raises SolveError naming them."""
    vector = np.asarray(value, dtype=float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise SolveError(f"{name} is {value!r}: three finite numbers are needed")
    return vector


def positive_radius(value: float, name: str):
    """A radius [m]; raises SolveError unless it is positive and finite."""
    if not (np.isfinite(value) and value > 0.0):
        raise SolveError(f"{name} radius is {value} m: it must be positive and finite")
    return float(value)


@dataclass(frozen=True)
class RigidPlane:
    """The body stays in normal·(x - point - motion(t)) >= 0.

    motion: t [s] -> displacement (3,) [m], None = at rest. slip: "frictionless", or "no_slip": touching points stick.
    """

    point: tuple
    normal: tuple
    motion: Callable | None = None
    slip: str = "frictionless"

    def row(self):
        """(kind, point, unit normal, radius) for the kernel."""
        normal = finite_vector(self.normal, "a plane's normal")
        size = np.linalg.norm(normal)
        if size == 0.0:
            raise SolveError("a plane's normal is (0, 0, 0): give a direction that points to the body's side")
        return np.array([PLANE, *finite_vector(self.point, "a plane's point"), *normal / size, 0.0])


@dataclass(frozen=True)
class RigidSphere:
    """The body stays outside |x - center - motion(t)| >= radius [m]; motion and slip as for a plane."""

    center: tuple
    radius: float
    motion: Callable | None = None
    slip: str = "frictionless"

    def row(self):
        """(kind, centre, unused, radius) for the kernel."""
        radius = positive_radius(self.radius, "a sphere's")
        return np.array([SPHERE, *finite_vector(self.center, "a sphere's center"), 0.0, 0.0, 0.0, radius])


@dataclass(frozen=True)
class RigidCapsule:
    """The body stays farther than `radius` [m] from the segment start..end, moved by motion(t); slip as for a plane."""

    start: tuple
    end: tuple
    radius: float
    motion: Callable | None = None
    slip: str = "frictionless"

    def row(self):
        """(kind, start, end - start, radius) for the kernel."""
        start, end = finite_vector(self.start, "a capsule's start"), finite_vector(self.end, "a capsule's end")
        if np.array_equal(start, end):
            raise SolveError(f"a capsule starts and ends at {start}: use a sphere, or move its end")
        return np.array([CAPSULE, *start, *end - start, positive_radius(self.radius, "a capsule's")])


Obstacle = RigidPlane | RigidSphere | RigidCapsule


def sticky(obstacles: Sequence[Obstacle]):
    """Which obstacles are no-slip, (no,) bool; raises SolveError for an unknown slip."""
    for k, obstacle in enumerate(obstacles):
        if obstacle.slip not in SLIP:
            raise SolveError(f"obstacle {k} has slip {obstacle.slip!r}: choose one of {', '.join(SLIP)}")
    return np.array([obstacle.slip == "no_slip" for obstacle in obstacles], dtype=bool)


def place(rows: np.ndarray, obstacles: Sequence[Obstacle], t: float):
    """Rows of the obstacles moved to time t; raises SolveError when a motion is not finite."""
    moved = rows.copy()
    for k, obstacle in enumerate(obstacles):
        if obstacle.motion is not None:
            moved[k, 1:4] += finite_vector(obstacle.motion(t), f"the motion of obstacle {k} at t = {t:g} s")
    return moved


@compiled()
def gap_into(row: np.ndarray, y: np.ndarray, n: np.ndarray, along: np.ndarray):
    """Gap g [m] between point y and an obstacle; unit normal n towards the body, curvature of g [1/m].

    d²g/dy² = curvature (1 - n⊗n - along⊗along): along (3,) is the axis of a capsule for points next to its cylindrical
    part, else 0.
    """
    g, share, squared = 0.0, 0.0, 0.0
    for i in range(3):
        along[i] = 0.0
    if row[0] == PLANE:
        for i in range(3):
            n[i] = row[4 + i]
            g += n[i] * (y[i] - row[1 + i])
        return g, 0.0
    if row[0] == CAPSULE:
        for i in range(3):
            share += row[4 + i] * (y[i] - row[1 + i])
            squared += row[4 + i] * row[4 + i]
        share = min(1.0, max(0.0, share / squared))
        if 0.0 < share < 1.0:
            for i in range(3):
                along[i] = row[4 + i] / np.sqrt(squared)
    for i in range(3):
        n[i] = y[i] - row[1 + i] - share * row[4 + i]
        g += n[i] * n[i]
    r = np.sqrt(g)
    for i in range(3):
        n[i] /= r
    return r - row[7], 1.0 / r


def gaps(row: np.ndarray, y: np.ndarray):
    """Gap of points y (..., 3) [m] in plain NumPy, independent of the kernel, to check it."""
    apart = y - row[1:4]
    if row[0] == PLANE:
        return apart @ row[4:7]
    if row[0] == CAPSULE:
        share = np.clip(apart @ row[4:7] / (row[4:7] @ row[4:7]), 0.0, 1.0)
        apart = apart - share[..., None] * row[4:7]
    return np.linalg.norm(apart, axis=-1) - row[7]
