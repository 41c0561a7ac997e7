"""Converts anatomical descriptions in millimetres to shapes in SI units; no other module converts them."""

from collections.abc import Callable

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.shape.blends import Sphere
from studies.geometry.shape.levelset import Level, PalpationPoint, Shape, gradient, normals, project
from studies.geometry.shape.regions import Vector

MM = 1e-3
"""Metres in a millimetre."""
MARGIN = 12.0
"""Room between an organ and the walls of its box [mm]: more than two cells of the coarsest grid, which has 5 mm."""


def check_lengths(organ: str, **lengths: float) -> None:
    for name, value in lengths.items():
        if not 0 < value < np.inf:
            raise StudyError(f"{organ}: {name} = {value} mm is not a length; give a finite number above 0")


def check_wall(organ: str, wall: float, narrowest: float) -> None:
    """Raise StudyError for a wall [mm] over 0.75 of the narrowest outer radius [mm] of the organ."""
    # A lumen narrower than a quarter of that radius cannot be meshed.
    if not wall <= 0.75 * narrowest:
        raise StudyError(
            f"{organ}: a wall of {wall:g} mm leaves no lumen where the radius is {narrowest:g} mm; "
            f"choose a wall up to {0.75 * narrowest:g} mm"
        )


def si(level: Level) -> Level:
    """Converts a level function in [mm] of points in [mm] to one in [m] of points in [m]."""
    return lambda points: level(np.asarray(points, float) / MM) * MM


def metres(x: float, y: float, z: float) -> Vector:
    """Three lengths [mm] in metres."""
    # Division rounds 43 mm to the same number as 0.043 m; multiplication by 0.001 does not.
    return float(x) / 1e3, float(y) / 1e3, float(z) / 1e3


def box_of(*tubes: list[Sphere]) -> tuple[Vector, Vector]:
    """Low and high corner [m] of a box that leaves MARGIN around canal surfaces with these control spheres [mm].

    A Bezier curve stays in the convex hull of its control points.
    """
    rows = np.array([sphere for tube in tubes for sphere in tube])
    low = (rows[:, :3] - rows[:, 3:]).min(axis=0) - MARGIN
    high = (rows[:, :3] + rows[:, 3:]).max(axis=0) + MARGIN
    return metres(*low), metres(*high)


def touch(level: Callable[[np.ndarray], np.ndarray], start: Vector, direction: Vector) -> PalpationPoint:
    """The point [m] where a ray from `start` [mm] along `direction` first meets level = 0, and the unit normal there;
    level: points (n, 3) [mm] -> (n,) [mm]. Raises StudyError if `start` lies inside, or if the ray meets no surface
    within 300 mm."""
    along = np.asarray(direction, float) / np.linalg.norm(direction)
    low, high = 0.0, 300.0
    # Each round divides the interval by 100. After eight it is below the spacing of floating-point numbers near 300.
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
    """The probe at the surface point [m] that the projection of `seed` [m] along the gradient reaches. Raises
    StudyError if `seed` lies too far from the surface."""
    point = project(shape, np.array([seed]))
    normal = normals(shape, point)[0]
    return PalpationPoint((float(point[0, 0]), float(point[0, 1]), float(point[0, 2])), unit(*normal))


def unit(x: float, y: float, z: float) -> Vector:
    length = float(np.sqrt(x * x + y * y + z * z))
    return float(x) / length, float(y) / length, float(z) / length
