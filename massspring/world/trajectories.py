"""Values over time: paths of obstacles and attachments, ramps of volumes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from massspring.errors import MassSpringError
from massspring.kernels.step.paths import displacements_into


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
        return self._alone(np.ascontiguousarray(t, dtype=np.float64).ravel())[:, 0].reshape(*np.shape(t), 3)

    @cached_property
    def _alone(self) -> "Paths":
        # A path of its own type that asks for this one must not be asked in turn.
        return Paths((Trajectory(self.times, self.displacements),))


STILL = Trajectory()


class Paths:
    """Several trajectories that compiled code evaluates together, since a run does so in every frame."""

    def __init__(self, paths: Sequence[Trajectory]) -> None:
        plain = [path if type(path).__call__ is Trajectory.__call__ else STILL for path in paths]
        self.first = np.cumsum([0, *(len(path.times) for path in plain)])
        self.times = np.array([t for path in plain for t in path.times], dtype=np.float64)
        keys = [key for path in plain for key in path.displacements]
        self.keys = np.array(keys, dtype=np.float64).reshape(-1, 3)
        self.other = [(k, path) for k, path in enumerate(paths) if path is not plain[k]]

    def __call__(self, t: np.ndarray) -> np.ndarray:
        """Displacements [m] at times `t` (q,) [s], (q, o, 3)."""
        out = np.empty((len(t), len(self.first) - 1, 3))
        displacements_into(t, self.first, self.times, self.keys, out)
        for k, path in self.other:  # a function, or of a type of its own
            out[:, k] = path(t)
        return out


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
