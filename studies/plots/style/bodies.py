"""Name, line and marker for every body recipe in a chart."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

from matplotlib.artist import Artist
from matplotlib.lines import Line2D
from matplotlib.typing import LineStyleType

from studies.base.counting import readable
from studies.metrics.run import Run, by_scene
from studies.plots.style.families import family_of
from studies.plots.style.style import BODY_LOOKS, SPARE_LOOKS, method_colour, method_label
from studies.runs.recipes import BodyRecipe

OPTIONS = ("law", "axis", "weights", "stiffness", "nodes")
"""Fields of a BodyRecipe that its `series` does not name, and that a chart may have to."""


@dataclass(frozen=True)
class BodyLook:
    """Name, line, marker and colour of a body in one chart."""

    name: str
    line: LineStyleType
    marker: str
    family_colour: str | None = None
    """Colour in a chart of one method and several families of bodies; None: the colour of the method."""

    def colour(self, method: str) -> str:
        return self.family_colour or method_colour(method)


def body_looks(runs: Sequence[Run], ignored: Sequence[str] = ()) -> dict[BodyRecipe, BodyLook]:
    """The look of every body recipe of `runs`.

    A name is the `series` of the recipe, followed by the options in which bodies of this series differ within a scene.
    ignored: options that the chart shows in another way. The first name of a series in BODY_LOOKS takes its look, every
    other name a spare look. Spare looks repeat after len(SPARE_LOOKS) names.
    """
    groups = [list(dict.fromkeys(run.case.body for run in group)) for group in by_scene(runs).values()]
    names = {body: _name(body, groups, ignored) for group in groups for body in group}
    families = {run.case.body: family_of(run.case).colour for run in runs}
    by_family = len({run.case.method.name for run in runs}) == 1 < len(set(families.values()))
    spare, free, looks = cycle(SPARE_LOOKS), dict(BODY_LOOKS), {}
    for body, name in names.items():
        if name not in looks:
            line, marker = free.pop(body.series) if body.series in free else next(spare)
            looks[name] = BodyLook(name, line, marker, families[body] if by_family else None)
    return {body: looks[name] for body, name in names.items()}


def _name(body: BodyRecipe, groups: Sequence[Sequence[BodyRecipe]], ignored: Sequence[str]) -> str:
    same = [[other for other in group if other.series == body.series] for group in groups]
    differing = [o for o in OPTIONS if any(len({getattr(other, o, None) for other in group}) > 1 for group in same)]
    return ", ".join([body.series, *(_words(body, option) for option in differing if option not in ignored)])


def _words(body: BodyRecipe, option: str) -> str:
    """The value of an option in words: "cotangent", "150 nodes", "stiffness 2", "weights 1:1:1:1"."""
    value = getattr(body, option)
    if option == "nodes":
        return f"{value:,} nodes"
    if option == "weights":
        return "default weights" if value is None else "weights " + ":".join(f"{weight:g}" for weight in value)
    return f"stiffness {value:g}" if option == "stiffness" else readable(value)


def body_method_handles(runs: Sequence[Run], looks: dict[BodyRecipe, BodyLook], markers: bool = False) -> list[Artist]:
    """Legend entries for every body and method that occur together.

    looks: of `body_looks`; markers: markers instead of lines.
    """
    pairs = dict.fromkeys((looks[run.case.body], run.case.method.name) for run in runs)
    return [body_handle(look, method, markers) for look, method in pairs]


def body_handle(look: BodyLook, method: str, markers: bool = False) -> Line2D:
    entry = Line2D([], [], color=look.colour(method), label=f"{look.name}, {method_label(method)}")
    if markers:
        entry.set(marker=look.marker, linestyle="", markersize=7)
    else:
        entry.set_linestyle(look.line)
    return entry
