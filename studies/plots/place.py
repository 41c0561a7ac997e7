"""Where an organ of the user is held and palpated: seen from the probe, and from the side."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch

from studies.geometry import OrganMesh
from studies.plots.style.page import finish, page, panels
from studies.plots.style.render import Camera, draw_surface, frame, scale_bar, uniform
from studies.plots.style.style import BLUE, ORANGE, SMALL, save, styled
from studies.scene.proposal import Proposal

TISSUE = "#D9B3A6"
BAR = 0.02
"""Length of the scale bar [m]."""


def draw_placing(mesh: OrganMesh, placing: Proposal, radius: float, path: Path) -> None:
    """Writes the picture of a proposal as PNG; radius: of the probe [m]. Raises StudyError if it cannot be written."""
    save(figure(mesh, placing, radius), path)


@styled
def figure(mesh: OrganMesh, placing: Proposal, radius: float) -> Figure:
    """Two views: along the motion of the probe, and horizontally from the side, at a right angle; radius [m]."""
    x, y, z = placing.palpation.normal
    facing = Camera(float(np.degrees(np.arctan2(y, x))), float(np.degrees(np.arcsin(np.clip(z, -1.0, 1.0)))))
    sheet = page(7.0, 4.2)
    views = (("as the probe sees it", facing), ("from the side", Camera(facing.azimuth + 90.0, 0.0)))
    for axes, (title, camera) in zip(panels(sheet, 1, 2)[0], views, strict=True):
        draw(axes, mesh, placing, radius, camera)
        axes.set_title(title)
    handles = [Patch(color=BLUE, label="held"), Patch(color=ORANGE, label="probe")]
    return finish(sheet, f"{mesh.name}: proposed by its shape", handles, columns=2)


def draw(axes: Axes, mesh: OrganMesh, placing: Proposal, radius: float, camera: Camera) -> None:
    """Draws the outer surface with its held part, and the probe before it presses; radius [m]."""
    points, triangles = mesh.points[: mesh.outer_count], mesh.outer_triangles
    colours = uniform(TISSUE, len(triangles))
    colours[(placing.hold.level(points)[triangles] <= 0).all(axis=1)] = to_rgb(BLUE)
    draw_surface(axes, points, triangles, colours, camera)
    centre = np.asarray(placing.palpation.point) + radius * np.asarray(placing.palpation.normal)
    right, up, _ = camera.see(centre)
    axes.add_patch(Circle((right, up), radius, facecolor=ORANGE, edgecolor="black", alpha=0.6))
    seen = np.vstack([camera.see(points)[:, :2], [[right - radius, up - radius], [right + radius, up + radius]]])
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = 0.08 * (high - low).max()
    frame(axes, low - 2 * room, high + room)
    scale_bar(axes, float(low[0]), float(low[1] - room), BAR, f"{1e3 * BAR:g} mm", size=SMALL)
