"""What the trials of both campaigns have in common: they repeat by a command, and fail by fewer choices."""

from collections.abc import Iterator
from dataclasses import MISSING, asdict, dataclass, fields, replace
from typing import Any, ClassVar, Self


@dataclass(frozen=True)
class Choices:
    """A trial; the default of each choice is its gentlest value, to which a failure is reduced."""

    COMMAND: ClassVar[str] = "organbench fuzz"
    seed: int
    number: int
    """Which one of its seed."""

    @property
    def line(self) -> str:
        """The command that repeats it."""
        return f"{self.COMMAND} --seed {self.seed} --trial {self.number}"

    @classmethod
    def gentlest(cls) -> dict[str, Any]:
        """The gentlest value of each choice that has one."""
        return {field.name: field.default for field in fields(cls) if field.default is not MISSING}

    @property
    def changed(self) -> dict[str, Any]:
        """The choices that are not the gentlest."""
        plain = self.gentlest()
        return {name: value for name, value in asdict(self).items() if value != plain.get(name, value)}

    def gentler(self) -> Iterator[Self]:
        """The trial with one choice more at its gentlest, or half-way there."""
        plain = self.gentlest()
        for name in self.changed:
            yield replace(self, **{name: plain[name]})
        whole = plain.get("steps", 1)
        for name in ("nodes", "steps"):
            value = getattr(self, name, 0)
            if value > 2 * plain.get(name, value):
                yield replace(self, **{name: int(value // 2 // whole * whole or value // 2)})
