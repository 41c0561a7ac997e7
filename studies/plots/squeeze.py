"""Figure 2 of the paper (JHC05) as a picture: a ball at rest, squeezed without and with the constraint, and the
reference."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull

from massspring import Plane
from studies.base.counting import readable
from studies.metrics.cells import MINUS
from studies.metrics.metrics import force_end, volume_end, volume_worst
from studies.metrics.run import Run
from studies.plots.style.page import blank, finish, page, panels, signed_percent
from studies.plots.style.render import Camera, draw_surface, frame, scale_bar, uniform
from studies.plots.style.style import BLACK, GREY, NORMAL, SMALL, drawing, method_colour, method_label, styled
from studies.store.schema import COMPARABLE

TITLE = "A soft ball between two planes"
SCENE, KINDS = "ball_squeeze", ("tetrahedral", "quadratic")
CAMERA = Camera(azimuth=-62.0, elevation=9.0)
PLATE, THICK = 1.40, 0.05
"""Radius and thickness of the discs that represent planes, over the radius of the ball."""
PALER = 0.22
REST, STEEL, GLASS = "#E8DCC8", "#8C8C8C", "#BFD3DC"
NAMES = {"free": "Springs alone", "implicit_volume": "Volume kept"}
"""Of methods, on a body of springs; the others come after them."""
KEPT = 0.05
"""If the volume never changes by this much [%], an upper bound of the change is given as a power of ten."""
DPI = 150


@styled
def figure(runs: Sequence[Run]) -> Figure:
    """A row of pictures with one scale and one camera: the ball at rest, one per method, and the reference if any."""
    squeezed = _chosen(runs)
    if not squeezed:
        return blank(TITLE, f"no run of {readable(SCENE)} has finished yet")
    some = squeezed[0]
    reference = some.reference
    sheet = page(3.0 * (len(squeezed) + (2 if reference else 1)), 3.75)
    axes = panels(sheet, 1, len(squeezed) + (2 if reference else 1))[0]
    outline = CAMERA.see(reference.surface()[0])[:, :2] if reference else None
    rest, triangles = some.fields.rest, some.fields.triangles
    volume = 1e6 * some.record.attributes["rest_volume"]
    _draw_ball(axes[0], some, rest, triangles, REST, at_rest=True)
    _caption(axes[0], "At rest", [f"volume {volume:.0f} mL"], BLACK)
    for panel, run in zip(axes[1:], squeezed, strict=False):
        colour = method_colour(run.case.method.name)
        _draw_ball(panel, run, run.fields.snapshots[-1], run.fields.triangles, colour)
        if outline is not None:
            _draw_outline(panel, outline)
        _caption(panel, *_words(run), colour)
    if reference:
        _draw_ball(axes[-1], some, *reference.surface(), STEEL)
        change = 100 * float(reference.field("volume")[-1] - 1)
        spread = 100 * reference.total_uncertainty["force_end"]
        words = [f"volume {change:+.3f} %".replace("-", MINUS), f"force {reference.force[-1]:.2f} N (± {spread:.1g} %)"]
        _caption(axes[-1], "Finite-element reference", words, BLACK)
    size = _radius(some)
    scale_bar(axes[0], -PLATE * size, -1.33 * size, 0.05, "50 mm", size=SMALL)
    notes = _notes(squeezed, outline is not None)
    return finish(sheet, TITLE, [], notes)


def _chosen(runs: Sequence[Run]) -> list[Run]:
    """The runs of SCENE that have reached their last checkpoint, one per kind of body and method: that with the
    largest step."""
    chosen: dict[tuple[str, str], Run] = {}
    for run in sorted(runs, key=lambda run: -run.record.attributes.get("dt", 0.0)):
        case = run.case
        if case.scene.name == SCENE and case.body.kind in KINDS and run.record.status in COMPARABLE:
            chosen.setdefault((case.body.kind, case.method.name), run)
    return [chosen[key] for key in sorted(chosen, key=lambda key: (KINDS.index(key[0]), key[1] not in NAMES, key[1]))]


def _radius(run: Run) -> float:
    return float(np.ptp(run.fields.rest, axis=0).max()) / 2


def _words(run: Run) -> tuple[str, list[str]]:
    force = float(run.force[run.checkpoint_frames[-1]])
    error = "" if run.reference is None else f" ({signed_percent(force_end(run))})"
    lines = [volume_words(volume_end(run), volume_worst(run)), f"force {force:.2f} N{error}"]
    name = NAMES.get(run.case.method.name, method_label(run.case.method.name))
    return f"Quadratic, {name.lower()}" if run.case.body.kind == "quadratic" else name, lines


def volume_words(end: float, worst: float) -> str:
    """In words: the volume change at the `end` [%], or an upper bound of the `worst` [%] if that is below KEPT."""
    if worst >= KEPT:
        return f"volume {signed_percent(end)}"
    worst = max(worst, 1e-14)  # about the resolution of double precision [%]
    power = int(np.floor(np.log10(worst)))
    digit = int(np.ceil(worst / 10.0**power))
    if digit == 10:
        digit, power = 1, power + 1
    exponent = str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"volume kept within {digit} × 10{exponent} %"


def _draw_ball(
    axes: Axes, run: Run, points: np.ndarray, triangles: np.ndarray, colour: str, at_rest: bool = False
) -> None:
    """Draws the planes below, the body, and the planes above: the right order for a low camera."""
    size = _radius(run)
    t = 0.0 if at_rest else run.case.scene.checkpoints[-1]
    planes = [plane for plane in run.case.scene.obstacles if isinstance(plane, Plane)]
    planes.sort(key=lambda plane: plane.point[2])
    for plane in [plane for plane in planes if plane.unit_normal[2] > 0]:
        draw_plane(axes, plane, t, size)
    draw_surface(axes, points, triangles, uniform(colour, len(triangles), PALER), CAMERA)
    for plane in [plane for plane in planes if plane.unit_normal[2] <= 0]:
        draw_plane(axes, plane, t, size)
    frame(axes, np.array([-1.5, -1.5]) * size, np.array([1.5, 1.25]) * size)


def draw_plane(axes: Axes, plane: Plane, t: float, size: float) -> None:
    """Draws a disc of glass whose face towards the body lies in the plane at time t [s]; size: of the ball, its radius
    [m]."""
    middle = np.asarray(plane.point) + plane.path(t)
    turn = np.linspace(0, 2 * np.pi, 181)
    rim = PLATE * size * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    near = CAMERA.see(middle + rim)[:, :2]
    far = CAMERA.see(middle + rim - THICK * size * plane.unit_normal)[:, :2]
    both = np.vstack([near, far])
    axes.add_patch(Polygon(both[ConvexHull(both).vertices], facecolor=GLASS, edgecolor=GREY, linewidth=0.8, alpha=0.30))
    axes.add_patch(Polygon(near, fill=False, edgecolor=GREY, linewidth=0.8, alpha=0.8))


def _draw_outline(axes: Axes, seen: np.ndarray) -> None:
    """Draws the outline of the reference: its shape is convex, so it is the hull of its points (n, 2) [m]."""
    hull = seen[ConvexHull(seen).vertices]
    axes.add_patch(Polygon(hull, fill=False, edgecolor=BLACK, linewidth=1.3, linestyle=(0, (4, 2)), joinstyle="round"))


def _caption(axes: Axes, title: str, lines: Sequence[str], colour: str) -> None:
    axes.set_title(title, size=NORMAL + 1, color=colour)
    axes.text(
        0.5, -0.02, "\n".join(lines), transform=axes.transAxes, ha="center", va="top", size=NORMAL, linespacing=1.45
    )


def _size(run: Run) -> str:
    springs = f"{run.record.attributes['springs']:,} springs"
    filled = "quadratic elements" if run.case.body.kind == "quadratic" else springs
    return f"{run.record.attributes['nodes']:,} nodes, {filled}"


def _notes(runs: Sequence[Run], outlined: bool) -> list[str]:
    scene = runs[0].case.scene
    sizes = dict.fromkeys(map(_size, runs))
    text = f"{scene.title}; shear modulus {scene.tissue.shear_modulus / 1e3:g} kPa; {'; '.join(sizes)}."
    return [text + (" Dashed: outline of the reference." if outlined else " There is no reference yet.")]


draw = drawing(figure, DPI)
