"""Figure 1 of the paper (JHC05) for our organs: each organ, and its structural, inner and bending springs."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from massspring import Body, Material, surface_body
from massspring.body.springs import SpringKind
from studies.base.counting import heading
from studies.geometry import OrganMesh
from studies.geometry.organs import make_shape
from studies.plots.figures.organs import FRONT, draw_smooth, window
from studies.plots.style.page import blank, finish, page, panels
from studies.plots.style.render import vertex_normals
from studies.plots.style.style import BLACK, BLUE, NORMAL, VERMILLION, save, styled

TITLE = "Springs of the surface body"
PANELS = {
    "structural springs": (SpringKind.STRUCTURAL, BLUE),
    "inner springs": (SpringKind.INNER, "#00704F"),
    "bending springs": (SpringKind.BENDING, VERMILLION),
}
AXIS_WORD = {"stomach": "centre_line"}
"""Organ -> kind of dominant axis: a bent organ has its centre line; all others have a straight axis."""
WIDTH, HEIGHT = 3.4, 3.6
"""Width and height of a panel [inch]."""
NEAR, FAR = 0.9, 0.16
"""Strength of the colour of lines on the near and on the far side, 0 (white) to 1."""


def body_of(mesh: OrganMesh) -> Body:
    outer = mesh.outer()
    # The springs depend only on the geometry, so any material gives the same picture.
    return surface_body(outer.points, outer.triangles, Material(1000.0, 1000.0), AXIS_WORD.get(mesh.name, "straight"))


@styled
def figure(meshes: Mapping[str, OrganMesh]) -> Figure:
    """One row per organ: the organ, and its structural, inner and bending springs; meshes: name -> mesh."""
    if not meshes:
        return blank(TITLE, "no organ given")
    sheet = page(WIDTH * (1 + len(PANELS)), HEIGHT * len(meshes))
    axes = panels(sheet, len(meshes), 1 + len(PANELS))
    for row, (name, mesh) in zip(axes, meshes.items(), strict=True):
        body = body_of(mesh)
        draw_smooth(row[0], make_shape(mesh.recipe["organ"], mesh.recipe["parameters"]), mesh, {})
        words = f"{mesh.outer_count:,} nodes, {len(mesh.outer_triangles):,} triangles"
        row[0].set_title(f"{heading(name)}\n{words}", size=NORMAL)
        for panel, (title, (kind, colour)) in zip(row[1:], PANELS.items(), strict=True):
            count = draw_springs(panel, body, mesh, kind, colour)
            panel.set_title(f"{heading(title)}\n{count:,}", size=NORMAL)
    axis = Line2D([], [], color=BLACK, marker="o", markersize=4, label="dominant axis and its virtual nodes")
    return finish(sheet, TITLE, [axis], ["Lines on the far side of the organ are paler."])


def draw_springs(axes: Axes, body: Body, mesh: OrganMesh, kind: SpringKind, colour: str) -> int:
    """Draws the springs of one kind, the far ones first and paler; returns their number."""
    springs = body.springs.ends[body.springs.kind == kind].astype(np.int64)
    seen = FRONT.see(body.rest)
    facing = FRONT.see(vertex_normals(mesh.points, mesh.outer_triangles)[: mesh.outer_count])[:, 2]
    if kind == SpringKind.INNER:
        # Inner springs have no near and far side, only a depth.
        depth = seen[springs, 2].mean(axis=1)
        share = (depth - depth.min()) / np.ptp(depth)
    else:
        share = np.clip(0.5 + 1.5 * facing[springs].mean(axis=1), 0.0, 1.0)
    order = np.argsort(share, kind="stable")
    strength = FAR + (NEAR - FAR) * share[order]
    colours = 1.0 - strength[:, None] * (1.0 - np.array(to_rgb(colour)))
    lines = LineCollection(list(seen[springs[order]][:, :, :2]), colors=list(colours), linewidths=0.8)
    axes.add_collection(lines, autolim=False)
    if kind == SpringKind.INNER:
        virtual = seen[mesh.outer_count :, :2]
        axes.plot(*virtual.T, color=BLACK, marker="o", markersize=4, linewidth=1.5, zorder=3)
    window(axes, body.rest[: mesh.outer_count], FRONT)
    return len(springs)


def draw_organ_springs(meshes: Mapping[str, OrganMesh], path: Path) -> None:
    """Writes the picture as PNG. Raises StudyError if it cannot be written."""
    save(figure(meshes), path)
