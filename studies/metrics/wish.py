"""Accuracy targets, and the default target."""

from dataclasses import dataclass

from studies.scene.kind import has_wall
from studies.scene.scene import Scene

SOLID, HOLLOW = (3.0, 1.0), (6.0, 3.0)
"""Default targets of the errors of force and displacement [%]."""


@dataclass(frozen=True)
class Wish:
    """Upper bounds on errors and cost; None: no bound."""

    force: float | None = None
    """Bound of |force_end| [%]."""
    displacement: float | None = None
    """Bound of mean_error [%]."""
    budget: float | None = None
    """Bound of computing time over simulated time [1]."""

    def or_usual(self, scene: Scene) -> "Wish":
        """The same, with the default targets if it bounds no error."""
        if self.force is not None or self.displacement is not None:
            return self
        return Wish(*(HOLLOW if has_wall(scene) else SOLID), self.budget)


def usual_wish(scene: Scene) -> Wish:
    """Force within 3 %, displacement within 1 %; of a hollow organ 6 and 3 %."""
    return Wish().or_usual(scene)
