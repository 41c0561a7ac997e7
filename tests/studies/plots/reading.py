"""Reads off a figure what is written and drawn there."""

from matplotlib.colors import to_hex
from matplotlib.text import Text


def words(figure):
    """Everything that is written."""
    return "\n".join(text.get_text() for text in figure.findobj(Text) if text.get_visible())


def lines(axes, colour):
    """Lines of one colour with data."""
    return [line for line in axes.get_lines() if to_hex(line.get_color()) == colour.lower() and len(line.get_xdata())]


def points(axes, colour):
    """(x, y, hollow) of single markers."""
    return [
        (float(line.get_xdata()[0]), float(line.get_ydata()[0]), line.get_markerfacecolor() == "white")
        for line in lines(axes, colour)
        if len(line.get_xdata()) == 1 and line.get_marker() != "None"
    ]
