"""What our own bodies reach in a scene, as a measure for what others hand in."""

from pathlib import Path
from typing import NamedTuple

from studies.catalog.accuracy import ACCURACY
from studies.metrics.cells import value_cell
from studies.metrics.judged import Judged, Measured, cheapest, nearest
from studies.metrics.wish import usual_wish
from studies.runs.recipe_text import body_words
from studies.scene.scene import Scene
from studies.tools.advise.campaign import stored

PAPER = 550
"""Surface nodes of the paper's body."""


class Yardstick(NamedTuple):
    """A body and its errors at full load, with the uncertainty of the reference, as text."""

    body: str
    force: str
    """force_end [%]."""
    displacement: str
    """mean_error [%]."""


def yardsticks(results: Path, scene: Scene) -> list[Yardstick]:
    """The paper's body and the one that `advise` recommends, of what is stored or published of the accuracy study; none
    for a scene that the study does not have. Raises StudyError where nothing of it is stored."""
    if scene not in ACCURACY.scenes:
        return []
    rows = stored(results, [scene]).cases[scene.name]
    wish = usual_wish(scene)
    paper = [one for one in rows if one.advisable and one.case.body.kind == "surface" and one.case.body.nodes == PAPER]
    best = cheapest(rows, wish) or nearest(rows, wish)
    pairs = [("the paper's body", one) for one in paper[:1]] + [("recommended", best)] * (best is not None)
    return [_row(name, one) for name, one in pairs if one is not None]


def _row(name: str, one: Judged) -> Yardstick:
    words = f"{name}: {body_words(one.case.body)} surface nodes"
    return Yardstick(words, _cell(one.force, signed=True), _cell(one.displacement, signed=False))


def _cell(error: Measured, signed: bool) -> str:
    return value_cell(error.value, error.uncertainty, signed=signed)
