"""Values over time: paths of obstacles and attachments, ramps of volumes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from massspring.errors import MassSpringError


def _check_keys(what: str, times: tuple[float, ...], named: str, values: tuple, units: str = "") -> None:
    """Raises MassSpringError for keys that do not make a function of time."""
    if len(times) != len(values) or not times:
        raise MassSpringError(f"a {what} has {len(times)} times for {len(values)} {named}; give one each")
    if not (np.isfinite(times).all() and np.isfinite(values).all()):
        raise MassSpringError(f"a {what} holds values that are not finite; give numbers{units}")
    if (np.diff(times) <= 0).any():
        raise MassSpringError(f"the times of a {what} are {times} s; they must ascend")


@dataclass(frozen=True)
class Trajectory:
    """Displacement over time, linear between key positions and constant outside them."""

    times: tuple[float, ...] = (0.0,)
    """[s], ascending."""
    displacements: tuple[tuple[float, float, float], ...] = ((0.0, 0.0, 0.0),)
    """[m] from the position at rest, one per time."""

    def __post_init__(self) -> None:
        _check_keys("path", self.times, "displacements", self.displacements, " in seconds and metres")

    def __call__(self, t: float | np.ndarray) -> np.ndarray:
        """Displacement [m] at time(s) `t` [s], (3,) or (q, 3)."""
        times, columns = self._keys
        displacement = np.empty((*np.shape(t), 3))
        for axis in range(3):
            displacement[..., axis] = np.interp(t, times, columns[axis])
        return displacement

    @cached_property
    def _keys(self) -> tuple[np.ndarray, np.ndarray]:
        """Times (k,) and displacements by axis (3, k) as arrays, since a run evaluates them in every frame."""
        return np.array(self.times), np.array(self.displacements).T.copy()


STILL = Trajectory()


@dataclass(frozen=True)
class Ramp:
    """A number over time, linear between key values and constant outside them."""

    times: tuple[float, ...] = (0.0,)
    """[s], ascending."""
    values: tuple[float, ...] = (1.0,)
    """One per time."""

    def __post_init__(self) -> None:
        _check_keys("ramp", self.times, "values", self.values)

    def __call__(self, t: float | np.ndarray) -> np.ndarray:
        """Value at time(s) `t` [s], () or (q,)."""
        return np.asarray(np.interp(t, self.times, self.values))
