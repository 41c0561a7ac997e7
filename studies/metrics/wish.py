"""Accuracy targets, and the default target."""

from dataclasses import dataclass

from studies.scene.kind import has_wall
from studies.scene.scene import Scene

SOLID, HOLLOW = (3.0, 1.0), (6.0, 3.0)
"""Errors of force and displacement that are enough [%]."""


@dataclass(frozen=True)
class Wish:
    """Upper bounds; None: of no interest."""

    force: float | None = None
    """Of |force_end| [%]."""
    displacement: float | None = None
    """Of mean_error [%], of the largest displacement."""
    budget: float | None = None
    """Of computing time over simulated time [1]."""

    def or_usual(self, scene: Scene) -> "Wish":
        """The same, with the errors that are usually enough where it names no error."""
        if self.force is not None or self.displacement is not None:
            return self
        return Wish(*(HOLLOW if has_wall(scene) else SOLID), self.budget)


def usual_wish(scene: Scene) -> Wish:
    """Force within 3 %, displacement within 1 %; of a hollow organ 6 and 3 %."""
    return Wish().or_usual(scene)
