"""Values over time: paths of obstacles and attachments, ramps of volumes."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from massspring.errors import MassSpringError

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class Trajectory:
    """Displacement over time, linear between key positions and constant outside them."""

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
        if len(self.times) != len(self.values) or not self.times:
            raise MassSpringError(f"a ramp has {len(self.times)} times for {len(self.values)} values; give one each")
        if not (np.isfinite(self.times).all() and np.isfinite(self.values).all()):
            raise MassSpringError("a ramp holds values that are not finite; give numbers")
        if (np.diff(self.times) <= 0).any():
            raise MassSpringError(f"the times of a ramp are {self.times} s; they must ascend")

    def __call__(self, t: float | np.ndarray) -> np.ndarray:
        """Value at time(s) `t` [s], () or (q,)."""
        return np.asarray(np.interp(t, self.times, self.values))
