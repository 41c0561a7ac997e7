"""Figure 4 of the paper (JHC05) from our run: a thin probe at first contact with the stomach, deep in it, and later."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from studies.base.counting import heading
from studies.plots.figures.organs import TISSUE
from studies.plots.squeeze import volume_words
from studies.plots.style.page import finish, page, panels
from studies.plots.style.render import Camera, draw_faces, frame, scale_bar, smooth_normals, uniform
from studies.plots.style.style import GREY, NORMAL, SMALL, save, styled
from studies.runs.paper import Played, moments, tip_of
from studies.scene.library.stomach_slide import PROBE

TITLE = "A thin probe touches the refined stomach, presses deep, and slides"
CAMERA = Camera(azimuth=-50.0, elevation=28.0)
ROD, SIDES, PIECES = "#5B6B7A", 10, 60
"""Colour of the shaft of the probe, its facets around, and its rings of corners along."""
SHAFT, THICK = 0.12, 0.0016
"""Length and radius of the shaft in the picture [m]."""
CLOSE = 0.030
"""Half the width of a close-up [m]."""
DPI = 150


def rod(tip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A shaft along the normal of the probe with its point at `tip` (3,) [m]: corners (k, 3, 3) [m] and unit normals
    (k, 3) of its triangles."""
    axis = np.asarray(PROBE.normal) / np.linalg.norm(PROBE.normal)
    across = np.cross(axis, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    turn = np.linspace(0, 2 * np.pi, SIDES, endpoint=False)
    ring = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(axis, across)
    height = SHAFT * np.linspace(0, 1, PIECES) ** 1.5
    radius = np.minimum(THICK, 0.35 * height)
    points = tip + height[:, None, None] * axis + radius[:, None, None] * ring
    low, high = points[:-1], points[1:]
    low_next, high_next = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    corners = np.concatenate([np.stack([low, low_next, high_next], axis=2), np.stack([low, high_next, high], axis=2)])
    normals = np.broadcast_to(ring, (2 * (PIECES - 1), SIDES, 3)).reshape(-1, 3)
    return corners.reshape(-1, 3, 3), normals


@styled
def figure(slide: Played) -> Figure:
    """A column per moment: the whole organ, and a close-up of the contact with the mesh."""
    columns = moments(slide)
    sheet = page(3.7 * len(columns), 7.6)
    axes = panels(sheet, 2, len(columns))
    body = slide.prepared.setup.body
    surface = len(np.unique(body.triangles))
    low, high = _window(CAMERA.see(body.rest[:surface])[:, :2])
    for (name, number), (whole, near) in zip(columns.items(), axes.T, strict=True):
        tip = tip_of(slide, number)
        x = slide.history.snapshots[number]
        _draw(whole, x, body.triangles, tip, 0.0)
        frame(whole, low, high)
        there = CAMERA.see(tip)[:2]
        box = {"fill": False, "edgecolor": GREY, "linewidth": 0.9}
        whole.add_patch(Rectangle(tuple(there - CLOSE), 2 * CLOSE, 2 * CLOSE, **box))
        _draw(near, x, body.triangles, tip, 0.12)
        frame(near, there - CLOSE, there + CLOSE)
        near.add_patch(Rectangle(tuple(there - CLOSE), 2 * CLOSE, 2 * CLOSE, **box))
        whole.set_title(heading(name), size=NORMAL + 1)
        words = f"{slide.history.t[number]:.2f} s, force {1e3 * slide.force[number]:.1f} mN"
        near.text(0.5, -0.02, words, transform=near.transAxes, ha="center", va="top", size=NORMAL)
    scale_bar(axes[0, 0], low[0], low[1], 0.05, "50 mm", size=SMALL)
    lost = 100 * (slide.history.volume / slide.history.volume_target - 1)[:, 0]
    note = f"{surface:,} nodes, {len(body.triangles):,} triangles, {body.springs.count:,} springs, centre-line axis; "
    note += f"{volume_words(float(lost[-1]), float(np.abs(lost).max()))}. Below: the same from near, with the mesh. "
    note += "The shaft is drawn thicker than the tip that is simulated."
    return finish(sheet, TITLE, [], [note])


def _window(seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Low and high corner, (2,) and (2,) [m], of a window around points seen by the camera (n, 2) [m]."""
    low, high = seen.min(axis=0), seen.max(axis=0)
    margin = 0.06 * float((high - low).max())
    return low - margin, high + margin


def _draw(axes: Axes, x: np.ndarray, triangles: np.ndarray, tip: np.ndarray, edges: float) -> None:
    """Draws organ and probe as one set of faces, so that nearer faces hide those behind."""
    corners = x[triangles.astype(np.int64)]
    shaft, around = rod(tip)
    normals = np.concatenate([smooth_normals(x, triangles.astype(np.int64)), around])
    colours = np.concatenate([uniform(TISSUE, len(corners)), uniform(ROD, len(shaft))])
    draw_faces(axes, np.concatenate([corners, shaft]), normals, colours, CAMERA, edges)


def draw(slide: Played, path: Path) -> None:
    """Writes the picture as PNG. Raises StudyError if it cannot be written."""
    save(figure(slide), path, DPI)
