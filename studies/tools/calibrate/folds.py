"""Which scenes a calibration of an organ is fitted on, and on which it is judged."""

from dataclasses import dataclass

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog.accuracy import judged_at_rest
from studies.geometry.organs import SHAPES
from studies.scene.kind import has_wall
from studies.scene.scene import Scene


@dataclass(frozen=True)
class Fold:
    """A fit and its trial."""

    fitted: tuple[Scene, ...]
    judged: tuple[Scene, ...]

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """All of them."""
        return (*self.fitted, *self.judged)


def own_scenes(organ: str) -> tuple[Scene, ...]:
    """The scenes of an organ that end at rest and have a reference. Raises StudyError where there is none."""
    lookup(organ, SHAPES, "organ")
    scenes = judged_at_rest()
    own = tuple(scene for scene in scenes if scene.organ.shape == organ)
    if not own:
        names = ", ".join(dict.fromkeys(scene.organ.shape for scene in scenes))
        raise StudyError(f"organ '{organ}' has no scene with a reference to fit; choose one of {names}")
    return own


def folds_of(organ: str) -> tuple[Fold, ...]:
    """Every scene of an organ judged by a fit on its others (leave one out); of an organ with one scene the scenes of
    other organs that are as hollow, judged by the fit on it. Raises StudyError."""
    own = own_scenes(organ)
    hollow = has_wall(own[0])
    if len(own) > 1:
        return tuple(Fold(tuple(other for other in own if other is not scene), (scene,)) for scene in own)
    alike = tuple(scene for scene in judged_at_rest() if scene.organ.shape != organ and has_wall(scene) == hollow)
    return (Fold(own, alike),)
