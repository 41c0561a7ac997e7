"""A body before its incision, after it, and the reference: pictures of how it gapes."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from studies.base.counting import heading
from studies.metrics.metrics import force_end, opening_error
from studies.metrics.run import Run, by_scene, doubled
from studies.plots.style.page import blank, finish, page, panels
from studies.plots.style.render import Camera, draw_faces, frame, scale_bar, smooth_normals
from studies.plots.style.style import NORMAL, SMALL, drawing, styled
from studies.store.schema import COMPARABLE

TITLE = "Incised organs"
CAMERAS = {
    "ball_incised": Camera(azimuth=-152.0, elevation=16.0),
    "ball_cut_twice": Camera(azimuth=-152.0, elevation=16.0),
    "shell_opened": Camera(azimuth=-152.0, elevation=16.0),
    "liver_incised": Camera(azimuth=-60.0, elevation=38.0),
    "liver_cut_live": Camera(azimuth=-60.0, elevation=38.0),
}
OTHER = Camera(azimuth=-72.0, elevation=25.0)
TISSUE, STEEL, INSIDE = "#D9B3A6", "#A9A9A9", "#8C2F39"
SIZE = (3.5, 3.0)
"""Width and height of a panel [inch]."""
DPI = 150
LEAST_NEWTONS = 0.1
"""Smaller forces are written in mN."""


def incised(run: Run) -> bool:
    """Whether a run can be shown: it has ended, has a reference and an incision with a front, and its first checkpoint
    is not after any cut."""
    cuts, first = run.case.scene.cuts, run.case.scene.checkpoints[0]
    whole = any(cut.within is not None for cut in cuts) and all(first <= cut.at for cut in cuts)
    return whole and run.reference is not None and run.record.status in COMPARABLE


@styled
def figure(runs: Sequence[Run]) -> Figure:
    scenes = by_scene([run for run in runs if incised(run)])
    if not scenes:
        return blank(TITLE, "no run of a scene with an incision and a reference has ended yet")
    sheet = page(3 * SIZE[0], SIZE[1] * len(scenes))
    notes = []
    for row, (name, group) in zip(panels(sheet, len(scenes), 3), scenes.items(), strict=True):
        best = min(group, key=opening_error)
        _draw_row(row, best, CAMERAS.get(name, OTHER))
        words = f"{heading(name)}: {best.case.body.series}, {best.record.attributes['nodes']:,} nodes"
        notes.append(f"{words}; {best.case.scene.title}.")
    return finish(sheet, TITLE, [Patch(color=INSIDE, label="faces of the cut")], notes)


def _draw_row(row: Sequence[Axes], run: Run, camera: Camera) -> None:
    reference = run.reference
    assert reference is not None  # incised() has checked
    rest, triangles = run.fields.rest, run.fields.triangles.astype(np.int64)
    nodes, facets = reference.field("nodes"), reference.triangles
    seen = [
        (run.fields.snapshots[0], triangles, doubled(rest, triangles, run.size), TISSUE),
        (run.fields.snapshots[-1], triangles, doubled(rest, triangles, run.size), TISSUE),
        (reference.surface()[0], facets, doubled(nodes, facets, run.size), STEEL),
    ]
    box = np.concatenate([camera.see(points)[:, :2] for points, *_ in seen])
    low, high = box.min(axis=0), box.max(axis=0)
    room = 0.06 * (high - low)
    for axes, (points, faces, inside, colour) in zip(row, seen, strict=True):
        colours = np.where(inside[:, None], to_rgb(INSIDE), to_rgb(colour))
        # The surface and the faces of the cut meet in a sharp edge, so their normals are averaged separately.
        normals = np.empty((len(faces), 3))
        for part in (inside, ~inside):
            normals[part] = smooth_normals(points, faces[part])
        draw_faces(axes, points[faces], normals, colours, camera, edges=0.12)
        frame(axes, low - room, high + room)
    at, force = run.checkpoint_frames, reference.force
    gap, truth = (
        1e3 * float(run.gap(each).max()) for each in (run.opening, reference.opening(rest[run.cut_pairs[:, 0]]))
    )
    off = f"{force_end(run):+.1f} %".replace("-", "−")
    words = (
        (f"{heading(run.case.scene.name)}, before", f"force {in_newtons(float(run.force[at[0]]))}"),
        ("cut and pulled", f"gapes {gap:.1f} mm, force {in_newtons(float(run.force[at[-1]]))} ({off})"),
        ("reference", f"gapes {truth:.1f} mm, force {in_newtons(float(force[-1]))}"),
    )
    for axes, (title, line) in zip(row, words, strict=True):
        axes.set_title(f"{title}\n{line}", size=NORMAL, weight="normal")
    left, below = low - 0.5 * room
    scale_bar(row[0], left, below, 0.05, "50 mm", size=SMALL)


def in_newtons(force: float) -> str:
    """A force [N] in words, in N, or in mN below LEAST_NEWTONS."""
    value, unit = (force, "N") if abs(force) >= LEAST_NEWTONS else (1e3 * force, "mN")
    return f"{value:.2f} {unit}".replace("-", "−")


draw = drawing(figure, DPI)
