"""One look for all charts: colours for colour-blind readers, type that is legible at half size, saving."""

import functools
import io
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.typing import LineStyleType

from massspring import LITERATURE, METHODS
from studies.base.atomic import write_whole
from studies.base.counting import readable
from studies.store.record import Status

P = ParamSpec("P")
R = TypeVar("R")

DPI = 110
"""Resolution of pictures: 10 inches are 1,100 pixels, and the smallest type is legible at half of that."""
SMALL, NORMAL, LARGE = 10.0, 11.5, 14.0
"""Type sizes [pt]: notes and tick labels, axes and legends, titles."""

# Okabe and Ito, "Color universal design", 2008.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILLION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
GREY, LIGHT, PALE = "#5A5A5A", "#B5B5B5", "#E4E4E4"

METHOD_COLOURS = {"free": VERMILLION, "implicit_volume": BLUE}
# The muted scheme of P. Tol, "Colour schemes", 2021.
MUTED = ("#332288", "#999933", "#882255", "#44AA99", "#DDCC77", "#AA4499", "#117733", "#661100", "#88CCEE", "#CC6677")
# Pear, light blue and olive of his light scheme.
LIGHT_SCHEME = ("#BBCC33", "#77AADD", "#AAAA00")
LITERATURE_COLOURS = ("#99DDFF", "#44BB99", "#EE8866", "#FFAABB")
"""Light cyan, mint, orange and pink of the same scheme."""
OTHER_METHODS = (GREEN, PURPLE, ORANGE, SKY, *MUTED, *LIGHT_SCHEME)
BODY_LOOKS: dict[str, tuple[LineStyleType, str]] = {
    "tetrahedral": ("-", "o"),
    "surface": ((0, (4, 1.6)), "s"),
    "tetrahedral, one volume": ((0, (1, 1.2)), "D"),
    "tetrahedral, nodal volumes": ((0, (6, 1.5, 1, 1.5)), "^"),
    "membrane": ((0, (2.5, 1)), "v"),
}
"""BodyRecipe.series -> line and marker of the bodies that look the same in every chart."""
SPARE_LOOKS: tuple[tuple[LineStyleType, str], ...] = (
    ((0, (4, 1, 1, 1, 1, 1)), "P"),
    ((0, (9, 1.5)), "<"),
    ((0, (3, 1, 3, 1, 1, 1)), "*"),
    ((0, (1, 3)), "p"),
    ((0, (3, 1, 1, 1, 1, 1, 1, 1)), ">"),
    ((0, (1, 1, 1, 3)), "h"),
    ((0, (3, 3.5)), "X"),
    ((0, (6, 1, 2, 1)), "d"),
    ((0, (2, 1, 2, 3)), "H"),
    ((0, (7, 1, 1, 1, 1, 1)), "8"),
)
"""Lines and markers of other bodies, in the order of appearance; each dash pattern fits into a legend entry."""
STATUS_LOOKS: dict[Status, tuple[str, str]] = {
    Status.OK: (GREEN, "o"),
    Status.FOLDED: (MUTED[5], "<"),
    Status.INVERTED: (PURPLE, "v"),
    Status.TUNNELLED: (MUTED[7], ">"),
    Status.SHAKEN: (MUTED[6], "h"),
    Status.DRIFTED: (YELLOW, "D"),
    Status.DIVERGED: (BLACK, "X"),
    Status.NOT_CONVERGED: (ORANGE, "P"),
    Status.BLOCKED: (MUTED[2], "^"),
    Status.TIMED_OUT: (SKY, "s"),
    Status.FAILED: (LIGHT, "*"),
    Status.SKIPPED: (GREY, "_"),
}
"""Status -> colour and marker; no colour is in METHOD_COLOURS."""

SHEET = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same letters on every machine
    "font.size": NORMAL,
    "axes.titlesize": NORMAL + 0.5,
    "axes.titleweight": "bold",
    "axes.labelsize": NORMAL,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": GREY,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.formatter.use_mathtext": True,
    "grid.color": PALE,
    "grid.linewidth": 0.8,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": BLACK,
    "ytick.labelcolor": BLACK,
    "legend.fontsize": SMALL,
    "legend.frameon": False,
    "figure.titlesize": LARGE,
    "figure.titleweight": "bold",
    "lines.linewidth": 1.9,
    "hatch.linewidth": 0.7,
}


VECTOR: dict[Any, Any] = {"svg.fonttype": "none", "svg.hashsalt": "organbench", "path.simplify_threshold": 0.3}
"""Settings of SVG: text stays text, identifiers are reproducible, and lines are simplified to a third of a pixel."""


def styled(build: Callable[P, R]) -> Callable[P, R]:
    """Decorates `build` to run with the defaults of matplotlib and SHEET, whatever the settings of the user."""

    @functools.wraps(build)
    def under_sheet(*args: P.args, **kwargs: P.kwargs) -> R:
        with matplotlib.style.context(["default", SHEET]):
            return build(*args, **kwargs)

    return under_sheet


@styled
def save(figure: Figure, path: Path, dpi: int = DPI) -> None:
    """Writes a figure as PNG, whole or not at all; the same figure gives the same bytes.

    Inside `svg_copies` it is also kept as SVG. Raises StudyError if it cannot be written.
    """
    image = io.BytesIO()
    FigureCanvasAgg(figure)
    figure.savefig(image, format="png", dpi=dpi, metadata={"Software": None}, facecolor="white")
    write_whole(path, image.getvalue())
    copies = _copies.get()
    if copies is not None:
        copies[path.name] = _svg(figure, dpi)


def drawing(figure: Callable[[R], Figure], dpi: int = DPI) -> Callable[[R, Path], None]:
    """The function (shown, path) that writes `figure(shown)` as a PNG file. It raises StudyError as `save` does."""

    def draw(shown: R, path: Path) -> None:
        """Writes the chart as PNG. Raises StudyError if it cannot be written."""
        save(figure(shown), path, dpi)

    draw.__module__ = figure.__module__
    return draw


@contextmanager
def svg_copies() -> Iterator[dict[str, str]]:
    """Inside, `save` also keeps every chart as SVG: name of its file -> text, which is reproducible."""
    kept: dict[str, str] = {}
    token = _copies.set(kept)
    try:
        yield kept
    finally:
        _copies.reset(token)


_copies: ContextVar[dict[str, str] | None] = ContextVar("copies", default=None)


def _svg(figure: Figure, dpi: int) -> str:
    """The figure as SVG, with the layout of the PNG: a new layout would take as long as drawing."""
    text = io.StringIO()
    figure.set_layout_engine("none")
    with matplotlib.rc_context(VECTOR):
        figure.savefig(text, format="svg", dpi=dpi, metadata=dict.fromkeys(("Creator", "Date")), facecolor="white")
    return text.getvalue()


def method_colour(name: str) -> str:
    """The colour of a method in every chart; that of an unknown method follows from a hash of its name."""
    if name in METHOD_COLOURS:
        return METHOD_COLOURS[name]
    for method, colour in zip(LITERATURE, LITERATURE_COLOURS, strict=True):
        if name == method.name:
            return colour
    others = [method.name for method in METHODS if method.name not in METHOD_COLOURS]
    if name in others:
        return OTHER_METHODS[others.index(name) % len(OTHER_METHODS)]
    spare = OTHER_METHODS[len(others) :] or OTHER_METHODS  # for a method that is in neither tuple
    return spare[zlib.crc32(name.encode()) % len(spare)]


def method_label(name: str) -> str:
    """The name of a method in a legend; the name of a method of the user or of another program stays unchanged."""
    ours = [method.name for method in (*METHODS, *LITERATURE)]
    return readable(name) if name in ours else name


def remark(axes: Axes, text: str) -> None:
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=GREY, size=SMALL)
