"""Where and when an organ is cut: a sheet in its rest configuration, the same material for every solver."""

from dataclasses import dataclass

from studies.base.errors import StudyError
from studies.geometry import BallRegion, HalfSpace


@dataclass(frozen=True)
class Cut:
    """A part of a plane that opens between two frames."""

    name: str
    plane: HalfSpace
    """Its level = 0, at rest; the front of the cut is where the level is positive."""
    within: HalfSpace | BallRegion | None = None
    """The blade: a half space cuts up to a straight front, a ball opens a disc inside the body; None: the whole
    section."""
    at: float = 0.0
    """When [s]."""
    contact: bool = False
    """Whether its faces touch, without friction, where they close; else they pass through each other."""
    free: bool = False
    """Whether a piece that nothing holds may go where it will."""

    def __post_init__(self) -> None:
        if not 0.0 < self.at < float("inf"):
            raise StudyError(f"cut '{self.name}' is made at {self.at} s; give a time after the start of the scene")
