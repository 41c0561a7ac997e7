"""Figures 2 and 3 of the paper (JHC05) from our runs: the ball after 800 iterations, and its volume over them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from massspring import Plane
from studies.plots.squeeze import CAMERA, PALER, PLATE, REST, draw_plane, volume_words
from studies.plots.style.page import finish, page, panels
from studies.plots.style.render import draw_surface, frame, scale_bar, uniform
from studies.plots.style.style import NORMAL, SMALL, method_colour, save, styled
from studies.runs.paper import Played

SQUEEZED, VOLUME = "A ball after 800 iterations of being squeezed", "Volume of the squeezed ball"
NAMES = {"free": "without the constraint", "implicit_volume": "with the constraint"}
PERCENT = 100.0
SMALLEST = 1e-10
"""Bottom of the logarithmic axis [%]; smaller values are rounding errors."""


def change(played: Played) -> np.ndarray:
    """Volume over its target minus 1 in every frame [%], (F,)."""
    return PERCENT * (played.history.volume / played.history.volume_target - 1)[:, 0]


@styled
def squeezed_figure(balls: Mapping[str, Played]) -> Figure:
    """The ball at rest, and squeezed without and with the constraint, with one scale and one camera.

    balls: method -> run.
    """
    sheet = page(3.4 * (1 + len(balls)), 3.6)
    axes = panels(sheet, 1, 1 + len(balls))[0]
    first = next(iter(balls.values()))
    body = first.prepared.setup.body
    _draw(axes[0], first, body.rest, REST, 0.0)
    axes[0].set_title("at rest", size=NORMAL + 1)
    _words(axes[0], f"volume {1e6 * body.volume:.0f} mL")
    for panel, (name, played) in zip(axes[1:], balls.items(), strict=True):
        _draw(panel, played, played.history.final, method_colour(name), played.history.t[-1])
        panel.set_title(NAMES[name], size=NORMAL + 1, color=method_colour(name))
        lost = change(played)
        kept = volume_words(float(lost[-1]), float(np.abs(lost).max()))
        _words(panel, f"{kept}\nforce {played.force[-1]:.2f} N")
    radius = float(np.ptp(body.rest, axis=0).max()) / 2
    scale_bar(axes[0], -PLATE * radius, -1.33 * radius, 0.05, "50 mm", size=SMALL)
    size = f"{len(np.unique(body.triangles)):,} surface nodes, {len(body.triangles):,} triangles"
    frame_ms = 1e3 * first.prepared.setup.clock.frame
    note = f"The paper's body: {size}, {body.springs.count:,} springs, straight axis. {first.case.scene.title}; "
    note += f"an iteration is a frame of {frame_ms:g} ms."
    return finish(sheet, SQUEEZED, [], [note])


def _words(axes: Axes, words: str) -> None:
    axes.text(0.5, -0.02, words, transform=axes.transAxes, ha="center", va="top", size=NORMAL, linespacing=1.45)


def _draw(axes: Axes, played: Played, points: np.ndarray, colour: str, t: float) -> None:
    body = played.prepared.setup.body
    radius = float(np.ptp(body.rest, axis=0).max()) / 2
    planes = [o for o in played.case.scene.obstacles if isinstance(o, Plane)]
    for plane in planes:
        if plane.unit_normal[2] > 0:
            draw_plane(axes, plane, t, radius)
    triangles = body.triangles.astype(np.int64)
    draw_surface(axes, points, triangles, uniform(colour, len(triangles), PALER), CAMERA)
    for plane in planes:
        if plane.unit_normal[2] <= 0:
            draw_plane(axes, plane, t, radius)
    frame(axes, np.array([-1.5, -1.5]) * radius, np.array([1.5, 1.25]) * radius)


@styled
def volume_figure(balls: Mapping[str, Played]) -> Figure:
    """The volume change in per cent, and its absolute value on a logarithmic axis, over iterations."""
    sheet = page(10.0, 3.9)
    left, right = panels(sheet, 1, 2)[0]
    for name, played in balls.items():
        lost = change(played)
        iteration = np.arange(1, len(lost) + 1)
        left.plot(iteration, lost, color=method_colour(name))
        right.plot(iteration, np.maximum(np.abs(lost), SMALLEST), color=method_colour(name))
    left.set_ylabel("volume V/V₀ − 1 [%]")
    right.set_ylabel("size |V/V₀ − 1| [%]")
    right.set_yscale("log")
    right.set_ylim(SMALLEST, 1e2)
    for axes in (left, right):
        axes.set_xlabel("iteration [1]")
        axes.set_xlim(0, None)
    handles = [Line2D([], [], color=method_colour(name), label=NAMES[name]) for name in balls]
    first = next(iter(balls.values()))
    clock = first.prepared.setup.clock
    last = round(first.case.scene.obstacles[0].path.times[-1] / clock.frame)
    note = f"An iteration is a frame of {1e3 * clock.frame:g} ms and {clock.steps} steps; "
    note += f"the planes stop at iteration {last}."
    return finish(sheet, VOLUME, handles, [note])


def draw(balls: Mapping[str, Played], squeezed: Path, volume: Path) -> None:
    """Writes both pictures as PNG. Raises StudyError if one cannot be written."""
    save(squeezed_figure(balls), squeezed)
    save(volume_figure(balls), volume)
