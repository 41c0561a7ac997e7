"""Cuts of an organ: their time, and a sheet in the rest configuration, the same for every solver."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from studies.base.errors import StudyError
from studies.geometry import BallRegion, HalfSpace
from studies.scene.placing import Vector

STEEPEST = 1e-6
"""Sine of the least angle between the normal of a plane and a direction in which a cut advances over it."""


@dataclass(frozen=True)
class Cut:
    """A part of a plane that opens between two frames, or over a time interval."""

    name: str
    plane: HalfSpace
    """The plane level = 0, at rest; the level is positive in front of the cut."""
    within: HalfSpace | BallRegion | None = None
    """The blade: a half space cuts up to a straight front, a ball opens a disc inside the body; None: the whole
    section."""
    at: float = 0.0
    """Time of the cut, or the start of a cut that advances [s]."""
    until: float | None = None
    """End of a cut that advances [s]; None: all of it opens at once."""
    along: Vector | None = None
    """Direction in which it advances, at constant speed; a vector of any length."""
    contact: bool = False
    """Whether its faces touch, without friction, where they close; else they pass through each other."""
    opens_lumen: bool = False
    """Whether it cuts through the wall of a hollow organ: the content of the lumen then drains, and its volume is no
    longer kept."""
    free: bool = False
    """Whether a piece without held nodes is allowed."""

    def __post_init__(self) -> None:
        if not 0.0 < self.at < float("inf"):
            raise StudyError(f"cut '{self.name}' is made at {self.at} s; give a time after the start of the scene")
        if (self.until is None) != (self.along is None):
            given, other = ("until", "along") if self.along is None else ("along", "until")
            raise StudyError(f"cut '{self.name}' has {given} and no {other}; a cut that advances has both")
        if self.until is not None and not self.at < self.until < float("inf"):
            raise StudyError(
                f"cut '{self.name}' advances from {self.at:g} s until {self.until:g} s; give a later end, or leave out "
                "until and along"
            )
        if self.along is not None:
            self._check_direction(self.along)

    def _check_direction(self, along: Vector) -> None:
        normal, size = self.plane.normal, math.hypot(*along)
        if not (0.0 < size < float("inf")):
            raise StudyError(f"cut '{self.name}' advances along {along}; give a direction of finite numbers, not all 0")
        if np.linalg.norm(np.cross(along, normal)) <= STEEPEST * size * np.linalg.norm(normal):
            raise StudyError(
                f"cut '{self.name}' advances along the normal of its plane, so it never crosses it; give a "
                "direction in the plane"
            )

    @property
    def unit_normal(self) -> np.ndarray:
        """Unit normal of its plane, towards its front, (3,)."""
        return np.asarray(self.plane.normal, float) / np.linalg.norm(self.plane.normal)

    @property
    def ends(self) -> float:
        """Time from which it is fully open [s]."""
        return self.at if self.until is None else self.until

    @property
    def at_once(self) -> "Cut":
        """The same sheet opened at one instant: the final equilibrium does not depend on how the cut advances."""
        return replace(self, until=None, along=None)


def sides_of(cuts: Sequence[Cut], points: np.ndarray) -> np.ndarray:
    """On which side of each plane the points (n, 3) [m] lie, (n,): a number for each choice, 0 behind all of them."""
    return sum((2**k * (cut.plane.level(points) > 0) for k, cut in enumerate(cuts)), np.zeros(len(points), np.int64))


def nearest_cut(cuts: Sequence[Cut], points: np.ndarray) -> np.ndarray:
    """The number of the cut whose blade is nearest to each of the points (n, 3) [m], (n,)."""
    distance = [
        np.hypot(cut.plane.level(points), 0.0 if cut.within is None else np.maximum(0.0, cut.within.level(points)))
        for cut in cuts
    ]
    return np.argmin(distance, axis=0)


def normals_at(cuts: Sequence[Cut], points: np.ndarray) -> np.ndarray:
    """The unit normal of the nearest cut at the points (n, 3) [m], (n, 3)."""
    return np.array([cut.unit_normal for cut in cuts])[nearest_cut(cuts, points)]
