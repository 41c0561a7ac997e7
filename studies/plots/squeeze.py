"""The paper's Figure 2: the ball at rest, squeezed with springs alone, with its volume kept, and the reference."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from massspring import Plane
from studies.metrics import Run, force_end, volume_end
from studies.plots.solid import camera, draw_solid, frame
from studies.plots.style import BLACK, GREY, LARGE, LIGHT, SMALL, method_colour, remark, save, styled
from studies.store import Status

SCENE, BODY = "ball_squeeze", "tetrahedral"
VIEW = camera(azimuth=-70.0, elevation=9.0)
TISSUE = "#C98A7B"
REFERENCE = "#9AA0A6"


@styled
def figure(runs: Sequence[Run]) -> Figure:
    """Four balls between their planes on one scale."""
    chosen = _chosen(runs)
    page = Figure(figsize=(11.0, 3.7))
    panels = page.subplots(1, 4)
    page.subplots_adjust(left=0.01, right=0.99, top=0.80, bottom=0.20, wspace=0.04)
    page.suptitle("A ball squeezed by 30 % of its diameter", y=0.97)
    if not chosen:
        for axes in panels:
            axes.axis("off")
        remark(panels[1], f"no finished runs of {SCENE} with a {BODY} body")
        return page
    any_run = next(iter(chosen.values()))
    rest = any_run.field("rest")
    widest = np.vstack([rest, *(run.field("snapshots")[-1] for run in chosen.values())])
    entries = [("at rest", rest, any_run.field("triangles"), TISSUE, None, "")]
    for name, words in (("free", "springs alone"), ("implicit_volume", "volume kept")):
        if name in chosen:
            run = chosen[name]
            shape, cells = run.field("snapshots")[-1], run.field("triangles")
            entries.append((words, shape, cells, TISSUE, method_colour(name), _numbers(run)))
    if any_run.reference is not None:
        points, triangles = any_run.reference.surface()
        ratio = any_run.reference.field("volume")[-1] - 1
        said = f"V/V0 − 1 = {_signed(100 * ratio)} %\nforce {any_run.reference.force[-1]:.3g} N"
        entries.append(("finite elements", points, triangles, REFERENCE, BLACK, said))
    for axes, (title, points, triangles, colour, ink, words) in zip(panels, entries, strict=False):
        draw_solid(axes, points, triangles, colour, VIEW)
        for z in _planes(any_run, pressed=title != "at rest"):
            _draw_plane(axes, _slab(z, widest))
        frame(axes, np.vstack([_slab(z, widest) for z in _planes(any_run, pressed=False)]), VIEW, margin=0.01)
        axes.set_title(title, color=ink or BLACK, size=LARGE - 1)
        axes.text(0.5, -0.04, words, transform=axes.transAxes, ha="center", va="top", size=SMALL + 1, color=ink or BLACK)
    for axes in panels[len(entries) :]:
        axes.axis("off")
    return page


def draw(runs: Sequence[Run], path: Path) -> None:
    """Draws the figure as a PNG."""
    save(figure(runs), path)


def _chosen(runs: Sequence[Run]) -> dict[str, Run]:
    """The runs of the scene and body at the largest step, by method."""
    fit = [r for r in runs if r.case.scene.name == SCENE and r.case.body.kind == BODY and r.record.status in DRAWABLE]
    fit.sort(key=lambda run: run.record.attributes["dt"])
    return {run.case.method.name: run for run in fit}


DRAWABLE = (Status.OK, Status.INVERTED, Status.DRIFTED)


def _numbers(run: Run) -> str:
    force = f"\nforce {_signed(force_end(run))} %" if run.reference is not None else ""
    return f"V/V0 − 1 = {_signed(volume_end(run))} %{force}"


def _signed(value: float) -> str:
    return "0.00" if abs(value) < 0.005 else f"{value:+.2g}".replace("-", "−") if abs(value) < 10 else f"{value:+.0f}".replace("-", "−")


def _planes(run: Run, pressed: bool) -> list[float]:
    t = run.case.scene.duration if pressed else 0.0
    planes = [o for o in run.case.scene.obstacles if isinstance(o, Plane)]
    return [float(o.point[2] + o.path(t)[2]) for o in planes]


def _slab(height: float, points: np.ndarray) -> np.ndarray:
    """Corners of a piece of plane a little wider than the widest ball [m], (4, 3)."""
    reach = 1.02 * float(np.abs(points[:, :2]).max())
    return np.array([[x, y, height] for x, y in ((-reach, -reach), (reach, -reach), (reach, reach), (-reach, reach))])


def _draw_plane(axes: Axes, corners: np.ndarray) -> None:
    """The upper plane lies before the ball, the lower one behind it."""
    seen = corners @ VIEW.T
    behind = corners[0, 2] < 0
    axes.fill(seen[:, 0], seen[:, 1], facecolor=LIGHT, alpha=0.5, zorder=0 if behind else 3, lw=0.8, ec=GREY)
