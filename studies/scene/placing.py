"""Helpers for scene files: palpation points, directions, times of a press."""

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.shape.levelset import PalpationPoint, Shape

Vector = tuple[float, float, float]


def press_times(start: float, end: float, steps: int, rest: float) -> tuple[float, ...]:
    """`steps` evenly spaced times up to the end of a press [s], the last replaced by `rest`, when the body is at
    rest."""
    times = np.linspace(start, end, steps + 1)[1:]
    return (*times[:-1].tolist(), rest)


def probe_of(shape: Shape) -> PalpationPoint:
    """The palpation point of the shape. Raises StudyError for a shape without one."""
    if shape.probe is None:
        raise StudyError(f"the shape '{shape.name}' names no probe point; give it one, or choose another organ")
    return shape.probe


def scaled(direction: Vector, length: float) -> Vector:
    """length · direction."""
    return (length * direction[0], length * direction[1], length * direction[2])


def along(point: Vector, direction: Vector, length: float) -> Vector:
    """point + length · direction."""
    step = scaled(direction, length)
    return (point[0] + step[0], point[1] + step[1], point[2] + step[2])
