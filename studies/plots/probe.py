"""A liver under a probe in three models, each with its force: one kept volume, the finest body, and the reference."""

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from massspring import Sphere
from studies.metrics.metrics import force_end
from studies.metrics.run import Run
from studies.plots.style.page import blank, finish, page, panels, signed_percent
from studies.plots.style.render import Camera, draw_surface, frame, scale_bar
from studies.plots.style.style import GREY, NORMAL, SMALL, drawing, styled
from studies.store.schema import COMPARABLE

TITLE = "A liver under a probe"
SCENE = "liver_probe"
CAMERA = Camera(azimuth=-112.0, elevation=4.0)
COLOURS = colormaps["YlOrRd"]
GLASS, MARGIN = "#BFD3DC", 0.012
DPI = 150


@styled
def figure(runs: Sequence[Run]) -> Figure:
    """Three pictures with one camera, one scale and one scale of colours, the displacement [mm]."""
    shown = [run for run in (_best(runs, "tetrahedral"), _best(runs, "quadratic")) if run is not None]
    reference = next((run.reference for run in shown if run.reference is not None), None)
    if reference is None:
        return blank(TITLE, f"no run of {SCENE} has finished yet")
    scene = shown[0].case.scene
    points, triangles = reference.surface()
    moved = 1e3 * np.linalg.norm(reference.field("displacement")[-1], axis=1)
    scale = Normalize(0.0, float(moved.max()))
    sheet = page(11.5, 3.5)
    axes = panels(sheet, 1, len(shown) + 1)[0]
    window = CAMERA.see(points)[:, :2]
    for panel, run in zip(axes, shown, strict=False):
        fields = run.fields
        u = 1e3 * np.linalg.norm(fields.snapshots[-1] - fields.rest, axis=1)
        _draw(panel, fields.snapshots[-1], fields.triangles, scale(u), 0.3)
        kind = "One kept volume" if run.case.body.kind == "tetrahedral" else "Quadratic body, a volume per vertex"
        force = run.force[run.checkpoint_frames[-1]]
        _caption(panel, kind, f"{force:.2f} N ({signed_percent(force_end(run))})")
    _draw(axes[-1], points, triangles, scale(moved), 0.0)
    spread = 100 * reference.total_uncertainty["force_end"]
    _caption(axes[-1], "Finite-element reference", f"{reference.force[-1]:.2f} N (± {spread:.1g} %)")
    for panel in axes:
        for probe in scene.obstacles:
            if isinstance(probe, Sphere):
                middle = CAMERA.see(np.asarray(probe.centre) + probe.path(scene.checkpoints[-1]))
                ball = Circle((middle[0], middle[1]), probe.radius, facecolor=GLASS, edgecolor=GREY, alpha=0.5)
                panel.add_patch(ball)
        frame(panel, window.min(axis=0) - MARGIN, window.max(axis=0) + MARGIN)
    left, below = window.min(axis=0) - MARGIN / 2
    scale_bar(axes[0], left, below, 0.05, "50 mm", size=SMALL)
    bar = sheet.colorbar(ScalarMappable(scale, COLOURS), ax=list(axes), shrink=0.6, pad=0.01)
    bar.set_label("displacement [mm]")
    sizes = ", ".join(f"{run.case.body.nodes:,}" for run in shown)
    return finish(sheet, TITLE, [], [f"{scene.title}. Surface nodes: {sizes}."])


def _best(runs: Sequence[Run], kind: str) -> Run | None:
    """The finest body of the kind that has ended well, with the volumes that are its default."""
    fitting = [r for r in runs if r.case.scene.name == SCENE and r.case.body.kind == kind]
    fitting = [r for r in fitting if r.record.status in COMPARABLE and r.case.body.volumes in ("scene", "vertex")]
    return max(fitting, key=lambda run: run.case.body.nodes, default=None)


def _draw(panel: Axes, points: np.ndarray, triangles: np.ndarray, shares: np.ndarray, edges: float) -> None:
    colours = COLOURS(np.clip(shares[triangles].mean(axis=1), 0.0, 1.0))[:, :3]
    draw_surface(panel, points, triangles, colours, CAMERA, edges)


def _caption(panel: Axes, title: str, words: str) -> None:
    panel.set_title(f"{title}\n{words}", size=NORMAL + 1)


draw = drawing(figure, DPI)
