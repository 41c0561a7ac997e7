"""A line of `make bench`: a promised number beside the measured one."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Line:
    """A promised number beside the measured one."""

    what: str
    measured: float
    unit: str
    target: float
    at_most: bool = True
    note: str = ""

    @property
    def met(self) -> bool:
        """Whether the target is reached."""
        return self.measured <= self.target if self.at_most else self.measured >= self.target
