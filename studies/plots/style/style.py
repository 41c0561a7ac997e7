"""One look for all charts: colours for colour-blind readers too, type that survives half size, one way to save."""

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
"""Of every picture: with it 10 inches are 1,100 pixels, and the smallest type is still read at half of that."""
SMALL, NORMAL, LARGE = 10.0, 11.5, 14.0
"""Type sizes [pt]: notes and tick labels, axes and legends, titles."""

# Okabe and Ito, "Color universal design", 2008.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILLION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
GREY, LIGHT, PALE = "#5A5A5A", "#B5B5B5", "#E4E4E4"

METHOD_COLOURS = {"free": VERMILLION, "implicit_volume": BLUE}
# Then the muted scheme of P. Tol, "Colour schemes", 2021.
MUTED = ("#332288", "#999933", "#882255", "#44AA99", "#DDCC77", "#AA4499", "#117733", "#661100", "#88CCEE", "#CC6677")
# And pear, light blue and olive of his light scheme, for the methods that came last.
LIGHT_SCHEME = ("#BBCC33", "#77AADD", "#AAAA00")
LITERATURE_COLOURS = ("#99DDFF", "#44BB99", "#EE8866", "#FFAABB")
"""Light cyan, mint, orange and pink of the same."""
OTHER_METHODS = (GREEN, PURPLE, ORANGE, SKY, *MUTED, *LIGHT_SCHEME)
BODY_LOOKS: dict[str, tuple[LineStyleType, str]] = {
    "tetrahedral": ("-", "o"),
    "surface": ((0, (4, 1.6)), "s"),
    "tetrahedral, one volume": ((0, (1, 1.2)), "D"),
    "tetrahedral, nodal volumes": ((0, (6, 1.5, 1, 1.5)), "^"),
    "membrane": ((0, (2.5, 1)), "v"),
}
"""Line and marker of the bodies that look the same in every chart, by BodyRecipe.series."""
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
"""Of any other body, in the order of its appearance; each dash pattern fits into the line of a legend entry."""
STATUS_LOOKS: dict[Status, tuple[str, str]] = {
    Status.OK: (GREEN, "o"),
    Status.INVERTED: (PURPLE, "v"),
    Status.DRIFTED: (YELLOW, "D"),
    Status.DIVERGED: (BLACK, "X"),
    Status.NOT_CONVERGED: (ORANGE, "P"),
    Status.BLOCKED: (MUTED[2], "^"),
    Status.TIMED_OUT: (SKY, "s"),
    Status.FAILED: (LIGHT, "*"),
    Status.SKIPPED: (GREY, "_"),
}
"""Colour and marker; none is the colour of one of the first two methods."""

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
"""Of SVG: letters stay letters, names in the file stay the same, and lines keep what a third of a pixel shows."""


def styled(build: Callable[P, R]) -> Callable[P, R]:
    """Runs `build` under matplotlib's defaults and SHEET, independent of the user's settings."""

    @functools.wraps(build)
    def under_sheet(*args: P.args, **kwargs: P.kwargs) -> R:
        with matplotlib.style.context(["default", SHEET]):
            return build(*args, **kwargs)

    return under_sheet


@styled
def save(figure: Figure, path: Path, dpi: int = DPI) -> None:
    """Writes a PNG, whole or not at all; the same figure gives the same bytes. Inside `svg_copies` it is
    also kept as SVG. Raises StudyError when it cannot be written."""
    image = io.BytesIO()
    FigureCanvasAgg(figure)
    figure.savefig(image, format="png", dpi=dpi, metadata={"Software": None}, facecolor="white")
    write_whole(path, image.getvalue())
    copies = _copies.get()
    if copies is not None:
        copies[path.name] = _svg(figure, dpi)


def drawing(figure: Callable[[R], Figure], dpi: int = DPI) -> Callable[[R, Path], None]:
    """Decorates a function that makes a figure: the result writes the figure as a PNG file. Raises StudyError as `save`
    does."""

    def draw(shown: R, path: Path) -> None:
        """Writes the chart as PNG."""
        save(figure(shown), path, dpi)

    draw.__module__ = figure.__module__
    return draw


@contextmanager
def svg_copies() -> Iterator[dict[str, str]]:
    """Inside, every chart that is saved is also kept as SVG: name of its file -> text, the same for the same figure."""
    kept: dict[str, str] = {}
    token = _copies.set(kept)
    try:
        yield kept
    finally:
        _copies.reset(token)


_copies: ContextVar[dict[str, str] | None] = ContextVar("copies", default=None)


def _svg(figure: Figure, dpi: int) -> str:
    """With everything where the PNG has it: to lay it out again takes as long as to draw it."""
    text = io.StringIO()
    figure.set_layout_engine("none")
    with matplotlib.rc_context(VECTOR):
        figure.savefig(text, format="svg", dpi=dpi, metadata=dict.fromkeys(("Creator", "Date")), facecolor="white")
    return text.getvalue()


def method_colour(name: str) -> str:
    """The colour a method has in every chart."""
    if name in METHOD_COLOURS:
        return METHOD_COLOURS[name]
    for method, colour in zip(LITERATURE, LITERATURE_COLOURS, strict=True):
        if name == method.name:
            return colour
    others = [method.name for method in METHODS if method.name not in METHOD_COLOURS]
    if name in others:
        return OTHER_METHODS[others.index(name) % len(OTHER_METHODS)]
    spare = OTHER_METHODS[len(others) :] or OTHER_METHODS  # a method that is not in METHODS
    return spare[zlib.crc32(name.encode()) % len(spare)]


def method_label(name: str) -> str:
    """The name of a method in a legend: that of a user's own method, or of an external entry, stays as it is."""
    ours = [method.name for method in (*METHODS, *LITERATURE)]
    return readable(name) if name in ours else name


def remark(axes: Axes, text: str) -> None:
    """Small grey words in the middle of a panel that has nothing to show."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=GREY, size=SMALL)
