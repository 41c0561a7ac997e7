"""The organs: their meshes, shaded, with the attachment regions coloured."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from studies.geometry import OrganMesh
from studies.plots.page import blank, finish, page, panels
from studies.plots.render import Camera, draw_surface, frame, scale_bar, uniform
from studies.plots.style import (
    BLUE,
    GREEN,
    NORMAL,
    ORANGE,
    PURPLE,
    SKY,
    SMALL,
    VERMILLION,
    heading,
    readable,
    save,
    styled,
)

TITLE = "Organs"
VIEWS = {"from the front": Camera(azimuth=-72.0, elevation=14.0), "from behind": Camera(azimuth=108.0, elevation=-10.0)}
"""Two sides, above and below: no attachment stays hidden."""
TISSUE = "#D9B3A6"
PATCH_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION)
WIDTH = 5.4
"""Of a picture [inch]."""
ROUND = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
"""Lengths of a scale bar [m]."""
DPI = 130


@styled
def figure(meshes: Mapping[str, OrganMesh]) -> Figure:
    """One column per mesh, seen from two sides, each filling its frame; the bar says how large it is."""
    if not meshes:
        return blank(TITLE, "no organ given")
    sheet = page(WIDTH * len(meshes), 7.4)
    axes = panels(sheet, len(VIEWS), len(meshes))
    names = dict.fromkeys(patch for mesh in meshes.values() for patch in mesh.patches)
    colours = {patch: PATCH_COLOURS[k % len(PATCH_COLOURS)] for k, patch in enumerate(names)}
    for column, (name, mesh) in zip(axes.T, meshes.items(), strict=True):
        for panel, (side, camera) in zip(column, VIEWS.items(), strict=True):
            _draw_organ(panel, mesh, colours, camera)
            panel.set_title(f"{heading(name)}, {side}", size=NORMAL + 1)
        _describe(column[-1], mesh)
    handles = [Patch(color=colour, label=f"held: {readable(patch)}") for patch, colour in colours.items()]
    return finish(sheet, TITLE, handles, columns=4)


def _draw_organ(axes: Axes, mesh: OrganMesh, colours: Mapping[str, str], camera: Camera) -> None:
    own = uniform(TISSUE, len(mesh.triangles))
    for patch in mesh.patches:
        held = np.zeros(len(mesh.points), bool)
        held[mesh.patches[patch]] = True
        own[held[mesh.triangles].all(axis=1)] = to_rgb(colours[patch])
    draw_surface(axes, mesh.points, mesh.triangles, own, camera, edges=0.5)
    seen = camera.see(mesh.points)[:, :2]
    low, high = seen.min(axis=0), seen.max(axis=0)
    margin = 0.05 * (high - low).max()
    frame(axes, low - (margin, 3.2 * margin), high + margin)
    length = max((bar for bar in ROUND if bar <= 0.4 * (high - low)[0]), default=ROUND[0])
    scale_bar(axes, low[0], low[1] - margin, length, f"{1e3 * length:g} mm", size=SMALL)


def _describe(axes: Axes, mesh: OrganMesh) -> None:
    solid = f", {len(mesh.tetrahedra):,} tetrahedra" if len(mesh.tetrahedra) else ", not filled"
    surface = f"{mesh.surface_count:,} surface nodes, {len(mesh.triangles):,} triangles"
    words = f"{1e6 * mesh.volume:,.0f} mL\n{surface}{solid}"
    axes.text(0.5, -0.02, words, transform=axes.transAxes, ha="center", va="top", size=NORMAL, linespacing=1.4)


def draw_organs(meshes: Mapping[str, OrganMesh], path: Path) -> None:
    """Writes the picture as PNG."""
    save(figure(meshes), path, DPI)
