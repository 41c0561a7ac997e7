"""The organs, shaded, with their meshes and attachments."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from studies.geometry import OrganMesh
from studies.plots.solid import camera, draw_solid, frame
from studies.plots.style import BLUE, GREEN, GREY, LARGE, ORANGE, SMALL, heading, readable, save, styled

VIEWS = (("from the front", camera(-90.0, 8.0)), ("from behind", camera(90.0, 8.0)))
TISSUE = {"liver": "#A8584A", "ball": "#C98A7B"}
PATCHES = (BLUE, GREEN, ORANGE)
ML = 1e6  # mL in a cubic metre


@styled
def figure(meshes: Mapping[str, OrganMesh]) -> Figure:
    """A row for each organ: front and back, attachments coloured, with node count and volume."""
    page = Figure(figsize=(9.0, 3.9 * max(len(meshes), 1)))
    panels = page.subplots(max(len(meshes), 1), 2, squeeze=False)
    page.subplots_adjust(left=0.02, right=0.98, top=0.93, bottom=0.05, hspace=0.25, wspace=0.05)
    for row, (name, mesh) in zip(panels, meshes.items(), strict=False):
        colours, handles = _colours(mesh, TISSUE.get(name, "#C98A7B"))
        for axes, (side, view) in zip(row, VIEWS, strict=True):
            draw_solid(axes, mesh.points, mesh.triangles, colours, view, edges=0.4)
            frame(axes, mesh.points, view)
            axes.set_title(f"{heading(name)}, {side}", size=LARGE - 1)
        words = f"{mesh.surface_count} surface nodes, {len(mesh.triangles)} triangles, {ML * mesh.volume:.0f} mL"
        row[0].text(0.0, -0.03, words, transform=row[0].transAxes, size=SMALL, color=GREY, va="top")
        if handles:
            row[1].legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=len(handles))
    return page


def _colours(mesh: OrganMesh, tissue: str) -> tuple[list[str], list[Patch]]:
    colours = np.full(len(mesh.triangles), tissue, dtype=object)
    handles = []
    for colour, name in zip(PATCHES, mesh.patches, strict=False):
        inside = np.zeros(len(mesh.points), dtype=bool)
        inside[mesh.patches[name]] = True
        colours[inside[mesh.triangles].all(axis=1)] = colour
        handles.append(Patch(color=colour, label=f"held: {readable(name)}"))
    return colours.tolist(), handles


def draw_organs(meshes: Mapping[str, OrganMesh], path: Path) -> None:
    """Draws the organs as a PNG."""
    save(figure(meshes), path)
