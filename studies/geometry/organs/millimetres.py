"""From an anatomical description in millimetres to a shape in SI units: the one place where they are converted."""

from collections.abc import Callable

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.shape.blends import Sphere
from studies.geometry.shape.levelset import Level, PalpationPoint, Shape, gradient, normals, project
from studies.geometry.shape.regions import Vector

MM = 1e-3
"""Metres in a millimetre."""
MARGIN = 12.0
"""Room between an organ and the walls of its box [mm]: two cells of the coarsest grid."""


def check_lengths(organ: str, **lengths: float) -> None:
    """Raise StudyError unless every length [mm] is a finite number above 0."""
    for name, value in lengths.items():
        if not 0 < value < np.inf:
            raise StudyError(f"{organ}: {name} = {value} mm is not a length; give a finite number above 0")


def check_wall(organ: str, wall: float, narrowest: float) -> None:
    """Raise StudyError unless the wall [mm] leaves a lumen inside the narrowest radius [mm] of the organ."""
    # The lumen of the narrowest tube keeps a quarter of its radius: less cannot be meshed.
    if not wall <= 0.75 * narrowest:
        raise StudyError(
            f"{organ}: a wall of {wall:g} mm leaves no lumen where the radius is {narrowest:g} mm; "
            f"choose a wall up to {0.75 * narrowest:g} mm"
        )


def si(level: Level) -> Level:
    """A level function of metres [m] from one of millimetres [mm]."""
    return lambda points: level(np.asarray(points, float) / MM) * MM


def metres(x: float, y: float, z: float) -> Vector:
    """Three lengths [mm] in metres."""
    # Division rounds 43 mm to the same number as 0.043 m; multiplication by 0.001 does not.
    return float(x) / 1e3, float(y) / 1e3, float(z) / 1e3


def box_of(*tubes: list[Sphere]) -> tuple[Vector, Vector]:
    """Corners [m] of a box around canal surfaces with the given control spheres [mm], with MARGIN to spare.

    A Bezier curve stays in the hull of its control points.
    """
    rows = np.array([sphere for tube in tubes for sphere in tube])
    low = (rows[:, :3] - rows[:, 3:]).min(axis=0) - MARGIN
    high = (rows[:, :3] + rows[:, 3:]).max(axis=0) + MARGIN
    return metres(*low), metres(*high)


def touch(level: Callable[[np.ndarray], np.ndarray], start: Vector, direction: Vector) -> PalpationPoint:
    """Where a ray from `start` [mm], outside, along `direction` first meets level = 0 [mm], and the normal there.

    Raises StudyError when it does not within 300 mm.
    """
    along = np.asarray(direction, float) / np.linalg.norm(direction)
    low, high = 0.0, 300.0
    # Each round narrows the interval a hundredfold: from 3 mm to less than numbers near 300 resolve.
    for _ in range(8):
        far = np.linspace(low, high, 101)
        inside = np.flatnonzero(level(np.asarray(start, float) + far[:, None] * along) < 0)
        if not len(inside) or (inside[0] == 0 and low == 0.0):
            raise StudyError(f"a ray from {start} mm along {direction} meets no organ from outside; move its start")
        low, high = far[max(inside[0] - 1, 0)], far[inside[0]]
    point = np.asarray(start, float) + high * along
    normal = gradient(level, point[None], 1e-4)[0]
    return PalpationPoint(metres(*point), unit(*normal))


def probe_near(shape: Shape, seed: Vector) -> PalpationPoint:
    """The probe at the surface point to which `seed` [m] is brought along the gradient.

    Raises StudyError when it lies too far off.
    """
    point = project(shape, np.array([seed]))
    normal = normals(shape, point)[0]
    return PalpationPoint((float(point[0, 0]), float(point[0, 1]), float(point[0, 2])), unit(*normal))


def unit(x: float, y: float, z: float) -> Vector:
    """The vector with length 1."""
    length = float(np.sqrt(x * x + y * y + z * z))
    return float(x) / length, float(y) / length, float(z) / length
