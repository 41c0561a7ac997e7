"""Shaded surfaces without a 3-D toolkit: orthographic camera, Lambert's law (softened), far triangles first."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

LIGHT = np.array([-0.45, 0.62, 0.64])
"""Direction towards the lamp, in the camera's frame: from the upper left, a little in front."""
DARKEST, RANGE, WRAP = 0.50, 0.58, 1.5
"""Brightness away from the lamp, what the lamp adds, and how fast the light falls off round the body."""
GLOSS, SHARPNESS = 0.22, 24
EDGE = 0.86
"""Brightness of the mesh lines over that of their triangle."""
HAIR = 0.3
"""Width of a line that closes the seam between smooth faces [pt]."""


@dataclass(frozen=True)
class Camera:
    """Where one looks from: degrees about z from the x axis, and above the xy plane."""

    azimuth: float
    elevation: float

    @property
    def frame(self) -> np.ndarray:
        """Rows: to the right, up, towards the eye; (3, 3)."""
        a, e = np.radians([self.azimuth, self.elevation])
        eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        return np.stack([right, np.cross(eye, right), eye])

    def see(self, points: np.ndarray) -> np.ndarray:
        """Points (…, 3) as (right, up, nearness) (…, 3), in the unit of the points."""
        return points @ self.frame.T


def vertex_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Area-weighted unit normals of the nodes (n, 3); zero for a node of no triangle."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    total = np.zeros_like(points)
    np.add.at(total, triangles, np.cross(b - a, c - a)[:, None, :])
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=np.zeros_like(total), where=length > 0)


def shade(normals: np.ndarray, colours: np.ndarray) -> np.ndarray:
    """Lit colours (t, 3) of faces with unit normals (t, 3) in the camera's frame and unlit colours (t, 3)."""
    facing = normals @ (LIGHT / np.linalg.norm(LIGHT))
    # Light that reaches round the body (half-Lambert) keeps the colour, which carries meaning, on the dark side.
    brightness = DARKEST + RANGE * (0.5 + 0.5 * facing) ** WRAP
    gloss = GLOSS * np.clip(facing, 0.0, None) ** SHARPNESS
    return np.clip(colours * brightness[:, None] + gloss[:, None], 0.0, 1.0)


def smooth_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals of the triangles (t, 3), each the mean of those of its nodes."""
    rows = vertex_normals(points, triangles)[triangles].mean(axis=1)
    return rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)


def draw_surface(
    axes: Axes, points: np.ndarray, triangles: np.ndarray, colours: np.ndarray, camera: Camera, edges: float = 0.4
) -> None:
    """Draws a closed surface: points (n, 3), outward triangles (t, 3), colours (t, 3), line width of the mesh [pt].

    Without lines (edges = 0) it looks smooth.
    """
    draw_faces(axes, points[triangles], smooth_normals(points, triangles), colours, camera, edges)


def draw_faces(
    axes: Axes, corners: np.ndarray, normals: np.ndarray, colours: np.ndarray, camera: Camera, edges: float = 0.4
) -> None:
    """Draws faces with corners (t, k, 3), unit normals (t, 3) for the light, colours (t, 3), lines of `edges` [pt].

    Those that look away, whose corners run clockwise, are left out; the others are drawn far ones first.
    """
    seen = camera.see(corners)
    x, y = (seen[:, :, :2] - seen[:, :1, :2]).transpose(2, 0, 1)
    facing = (x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1) > 0
    order = np.argsort(seen[:, :, 2].mean(axis=1), kind="stable")
    order = order[facing[order]]
    lit = shade(camera.see(normals[order]), colours[order])
    # Without a line in its colour a face would show a thin gap along its edges.
    line, width = (EDGE * lit, edges) if edges else (lit, HAIR)
    polygons = PolyCollection(seen[order][:, :, :2], facecolors=lit, edgecolors=line, linewidths=width)  # pyright: ignore[reportArgumentType]
    polygons.set_joinstyle("round")
    polygons.set_rasterized(True)  # thousands of faces are a small picture, but a large SVG
    axes.add_collection(polygons, autolim=False)


def uniform(colour: str, count: int, light: float = 0.0) -> np.ndarray:
    """`count` times a colour, mixed with white by `light` from 0 to 1; (count, 3)."""
    rgb = np.array(to_rgb(colour))
    return np.tile((1 - light) * rgb + light, (count, 1))


def frame(axes: Axes, low: np.ndarray, high: np.ndarray) -> None:
    """No axes, equal scales, the window [low, high] (2,) in the unit of the points."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])


def scale_bar(axes: Axes, left: float, below: float, length: float, words: str, **text: object) -> None:
    """A bar of `length` from (left, below), its meaning under it."""
    axes.plot([left, left + length], [below, below], color="black", linewidth=2, solid_capstyle="butt")
    axes.annotate(
        words,
        (left + length / 2, below),
        xytext=(0, -4),
        textcoords="offset points",
        ha="center",
        va="top",
        **text,  # pyright: ignore[reportArgumentType]
    )
