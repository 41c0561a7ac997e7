"""Shaded surfaces, drawn by matplotlib: orthographic, lit from above the camera, far triangles first."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

AMBIENT = 0.42
"""Brightness of a face turned away from the light."""


def camera(azimuth: float, elevation: float) -> np.ndarray:
    """Rows: right, up and towards the eye [1], (3, 3), for angles [degree] around and above the horizon (z is up)."""
    a, e = np.radians([azimuth, elevation])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.array([right, np.cross(eye, right), eye])


def draw_solid(
    axes: Axes, points: np.ndarray, triangles: np.ndarray, colours: object, view: np.ndarray, edges: float = 0.25
) -> None:
    """Adds the surface `triangles` (t, 3) on `points` (n, 3) to an axes in the plane of the picture.

    colours: one colour, or one for each triangle; edges: width of the mesh lines [pt], 0 for none.
    """
    seen = points @ view.T
    corners = seen[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    front = normal[:, 2] > 0
    light = np.array([-0.35, 0.55, 0.76])
    shade = AMBIENT + (1 - AMBIENT) * np.clip(normal @ light, 0, 1)
    base = np.array([to_rgb(c) for c in colours]) if isinstance(colours, list) else np.tile(to_rgb(colours), (len(triangles), 1))  # type: ignore[arg-type]
    faces = np.clip(base * shade[:, None], 0, 1)
    order = np.flatnonzero(front)[np.argsort(corners[front, :, 2].mean(axis=1))]
    axes.add_collection(
        PolyCollection(
            corners[order, :, :2].tolist(),  # type: ignore[arg-type]
            facecolors=faces[order],
            edgecolors=0.72 * faces[order],
            linewidths=edges,
            antialiaseds=True,
        )
    )
    axes.set_aspect("equal")
    axes.axis("off")


def frame(axes: Axes, points: np.ndarray, view: np.ndarray, margin: float = 0.06) -> None:
    """Sets the limits around `points` (n, 3), with a margin as a share of the larger side."""
    seen = points @ view.T
    low, high = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
    room = margin * float((high - low).max())
    axes.set_xlim(low[0] - room, high[0] + room)
    axes.set_ylim(low[1] - room, high[1] + room)
