"""Accuracy targets, and the default target."""

from collections.abc import Mapping
from dataclasses import dataclass

from studies.meshing.bounds import SHAPE, SHAPE_VOLUME
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


def missed(scene: Scene, values: Mapping[str, float]) -> list[str]:
    """Of metrics [%] by name those that miss the default target of the scene, or a bound of the shape."""
    wish = usual_wish(scene)
    bounds = {"force_end": wish.force, "mean_error": wish.displacement}
    bounds |= {"shape_error": SHAPE, "shape_volume": SHAPE_VOLUME}
    return [name for name, value in values.items() if (bound := bounds.get(name)) is not None and abs(value) > bound]
