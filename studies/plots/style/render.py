"""Shaded surfaces without a 3-D toolkit: orthographic camera, half-Lambert shading, painter's algorithm."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

LIGHT = np.array([-0.45, 0.62, 0.64])
"""Direction towards the light (right, up, towards the eye) in the frame of the camera: from the upper left in front."""
DARKEST, RANGE, WRAP = 0.50, 0.58, 1.5
"""Brightness on the side away from the light, what the light adds at most, and the exponent of its decay."""
GLOSS, SHARPNESS = 0.22, 24
EDGE = 0.86
"""Brightness of mesh lines over that of their face."""
HAIR = 0.3
"""Width of the lines that close the gaps between faces without mesh lines [pt]."""


@dataclass(frozen=True)
class Camera:
    """Direction of the eye: azimuth about z from the x axis, and elevation above the xy plane [degrees]."""

    azimuth: float
    elevation: float

    @property
    def frame(self) -> np.ndarray:
        """Unit vectors to the right, up, and towards the eye, as rows (3, 3)."""
        a, e = np.radians([self.azimuth, self.elevation])
        eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        return np.stack([right, np.cross(eye, right), eye])

    def see(self, points: np.ndarray) -> np.ndarray:
        """Coordinates (right, up, towards the eye) of points (…, 3), shape (…, 3), in the unit of the points."""
        return points @ self.frame.T


def vertex_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Area-weighted unit normals of the nodes, (n, 3); zero for a node without a triangle."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    total = np.zeros_like(points)
    np.add.at(total, triangles, np.cross(b - a, c - a)[:, None, :])
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=np.zeros_like(total), where=length > 0)


def shade(normals: np.ndarray, colours: np.ndarray) -> np.ndarray:
    """Lit colours (t, 3), 0 to 1, of faces with unit normals (t, 3) in the frame of the camera and colours (t, 3)."""
    facing = normals @ (LIGHT / np.linalg.norm(LIGHT))
    # Half-Lambert shading keeps the colour visible on the dark side, because colour carries meaning.
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
    """Draws a closed surface: points (n, 3), outward triangles (t, 3), colours (t, 3), lines of width `edges` [pt].

    With edges = 0 there are no mesh lines.
    """
    draw_faces(axes, points[triangles], smooth_normals(points, triangles), colours, camera, edges)


def draw_faces(
    axes: Axes, corners: np.ndarray, normals: np.ndarray, colours: np.ndarray, camera: Camera, edges: float = 0.4
) -> None:
    """Draws faces: corners (t, k, 3), unit normals (t, 3) for the light, colours (t, 3), lines of width `edges` [pt].

    Faces whose corners are clockwise in the picture look away and are left out. The farthest are drawn first.
    """
    seen = camera.see(corners)
    x, y = (seen[:, :, :2] - seen[:, :1, :2]).transpose(2, 0, 1)
    facing = (x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1) > 0
    order = np.argsort(seen[:, :, 2].mean(axis=1), kind="stable")
    order = order[facing[order]]
    lit = shade(camera.see(normals[order]), colours[order])
    # Without a line in the colour of the face there would be thin gaps between faces.
    line, width = (EDGE * lit, edges) if edges else (lit, HAIR)
    polygons = PolyCollection(seen[order][:, :, :2], facecolors=lit, edgecolors=line, linewidths=width)  # pyright: ignore[reportArgumentType]
    polygons.set_joinstyle("round")
    polygons.set_rasterized(True)  # thousands of faces are large as vectors in an SVG
    axes.add_collection(polygons, autolim=False)


def uniform(colour: str, count: int, light: float = 0.0) -> np.ndarray:
    """A colour mixed with white by `light` from 0 to 1, `count` times, (count, 3)."""
    rgb = np.array(to_rgb(colour))
    return np.tile((1 - light) * rgb + light, (count, 1))


def frame(axes: Axes, low: np.ndarray, high: np.ndarray) -> None:
    """Hides the axes, sets equal scales and the window from `low` to `high`, both (2,), in the unit of the points."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])


def scale_bar(axes: Axes, left: float, below: float, length: float, words: str, **text: object) -> None:
    """Draws a horizontal bar of `length` from (left, below), in the unit of the points, with `words` below it."""
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
