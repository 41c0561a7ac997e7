"""Properties of the surroundings of a body that a method may refuse."""

from dataclasses import dataclass

from massspring.world.obstacles import Obstacle


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Obstacles, what is held, loads and the start of a run."""

    obstacles: tuple[Obstacle, ...] = ()
    attachments: int = 0
    """How many."""
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """[m/s²]."""
    targets: bool = False
    """Whether a target is given for a kept volume."""
    moved: bool = False
    """Whether the body starts with velocities, or in another shape than at rest."""

    @property
    def rough(self) -> bool:
        """Whether an obstacle has friction."""
        return any(getattr(obstacle, "friction", 0.0) != 0.0 for obstacle in self.obstacles)
