"""A line of `make bench`: a promised number next to the measured one, or what the machine itself gives."""

from dataclasses import dataclass


@dataclass(frozen=True)
class BenchLine:
    """A promised number next to the measured one; without a target it measures the machine, not the code."""

    what: str
    measured: float
    unit: str
    target: float | None = None
    at_most: bool = True
    note: str = ""

    @property
    def promise(self) -> str:
        """The target in words."""
        return "" if self.target is None else f"{'<=' if self.at_most else '>='} {self.target:g}"

    @property
    def words(self) -> str:
        """The line as `make bench` prints it, in columns."""
        note = f"  {self.note}" if self.note else ""
        return f"{self.verdict:>3}  {self.measured:>10.4g} {self.unit:<10} {self.promise:<11} {self.what}{note}"

    @property
    def verdict(self) -> str:
        """Whether the target is reached."""
        if self.target is None:
            return ""
        reached = self.measured <= self.target if self.at_most else self.measured >= self.target
        return "yes" if reached else "NO"
