"""What every chart promises: a PNG whatever the runs are, the same bytes again, units, and nothing over the data."""

import re
import sys
from functools import cache

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from massspring import Free
from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.plots import cut_open, laws, opening, pieces, probe, squeeze
from studies.plots.campaigns import stability
from studies.plots.style.style import DPI, SMALL, styled
from studies.store.record import Status
from tests.campaigns import campaigns_but
from tests.studies.plots.made_up import grid, laws_grid, run, stability_grid, timed_grid, without_reference
from tests.studies.plots.test_bodies import RECIPES

OWN = {stability: stability_grid, laws: laws_grid}
"""Charts whose axes the plain grids do not fill."""


def good_runs(studies):
    """Chart (a module with `figure` and `draw`) -> made-up runs, timed where its study is; each chart once."""
    runs = {}
    for study in studies:
        made = timed_grid if any(case.timed for case in study.cases) else grid
        for chart in study.charts:
            module = sys.modules[chart.draw.__module__]
            runs.setdefault(module, OWN.get(module, made))
    return runs


GOOD = good_runs(STUDIES)
ODD = {
    "none": list,
    "no reference": lambda: without_reference([*grid()[:4], *timed_grid()[:4]]),
    "all diverged": lambda: [run(method=Free(), status=Status.DIVERGED), run(status=Status.DIVERGED)],
    "all failed": lambda: [run(status=Status.FAILED)],
    "each status": lambda: [run(status=status) for status in Status],
    "one timed run": lambda: [run(frame_ms=0.5)],
    "exact": lambda: [run(error=0.0, volume_end=0.0, frame_ms=0.5), run(error=0.0, method=Free(), frame_ms=0.5)],
    "bodies of all kinds": lambda: [run(frame_ms=0.5, **each) for each in RECIPES],
    "one body, several regions": lambda: [run(frame_ms=0.5, recipe={"volumes": "regions", "regions": 5})],
    "exploding": lambda: [run(volume_end=1e30, error=-1e30, status=Status.DRIFTED), run()],
}
ODDEST = ("none", "no reference", "each status", "exploding")
CHARTS = pytest.mark.parametrize("chart", GOOD, ids=lambda chart: chart.__name__.rsplit(".", 1)[-1])


@cache
@styled
def drawn(chart):
    """The figure of the good runs, laid out as it is saved."""
    figure = chart.figure(GOOD[chart]())
    FigureCanvasAgg(figure).draw()
    return figure


@CHARTS
def test_same_runs_same_bytes(chart, tmp_path):
    chart.draw(GOOD[chart](), tmp_path / "a.png")
    chart.draw(GOOD[chart](), tmp_path / "b.png")
    image = (tmp_path / "a.png").read_bytes()
    assert image[:8] == b"\x89PNG\r\n\x1a\n"
    assert image == (tmp_path / "b.png").read_bytes()
    assert b"Software" not in image  # or a new matplotlib would change every picture


@CHARTS
@pytest.mark.parametrize("runs", campaigns_but(ODD, lambda runs: runs in ODDEST))
def test_whatever_the_runs_are_there_is_a_picture(chart, runs, tmp_path):
    chart.draw(ODD[runs](), tmp_path / "new" / "a.png")
    assert (tmp_path / "new" / "a.png").stat().st_size > 2000


@CHARTS
def test_a_chart_that_cannot_be_written_says_so(chart, tmp_path):
    (tmp_path / "file").write_text("where the folder should be")
    with pytest.raises(StudyError, match=r"a\.png"):
        chart.draw([], tmp_path / "file" / "a.png")


@CHARTS
def test_axes_carry_units(chart):
    labels = [
        label
        for axes in drawn(chart).findobj(lambda artist: hasattr(artist, "get_ylabel"))
        for label in (axes.get_xlabel(), axes.get_ylabel())
        if label
    ]
    # The runs of `grid` have no cut: tests/studies/runs/test_cutting.py draws some that have.
    assert chart in (squeeze, opening, pieces, cut_open, probe) or labels
    assert [label for label in labels if not re.search(r"\[[^\]]+\]", label)] == []


@CHARTS
def test_legend_and_notes_lie_below_all_panels(chart):
    figure = drawn(chart)
    lowest = min(axes.get_tightbbox().y0 for axes in figure.findobj(lambda artist: hasattr(artist, "get_ylabel")))
    below = [*figure.legends, *(text for text in figure.texts if text is not figure._suptitle)]
    assert below or chart in (opening, pieces, cut_open, probe)  # their runs here have no cut
    assert all(item.get_window_extent().y1 <= lowest + 1 for item in below)
    notes = [text.get_window_extent() for text in figure.texts if text is not figure._suptitle]
    assert all(legend.get_window_extent().y0 >= note.y1 - 1 for legend in figure.legends for note in notes)
    assert all(axes.get_legend() is None for axes in figure.axes)


@CHARTS
def test_all_type_is_on_the_page_and_large_enough(chart):
    """Half size must be readable, and nothing cut off."""
    figure = drawn(chart)
    texts = [text for text in figure.findobj(Text) if text.get_text() and text.get_visible()]
    # Tick labels outside the limits of their axis are made, but not drawn.
    boxes = [figure.get_tightbbox(), *(text.get_window_extent() for text in figure.texts)]
    assert min(text.get_fontsize() for text in texts) >= SMALL
    width, height = figure.bbox.width, figure.bbox.height
    tight = boxes[0]
    assert tight.x0 * figure.dpi >= -1
    assert tight.x1 * figure.dpi <= width + 1
    assert all(box.x0 >= -1 and box.x1 <= width + 1 and box.y0 >= -1 and box.y1 <= height + 1 for box in boxes[1:])
    assert 8 <= figure.get_figwidth() <= 12
    assert DPI * SMALL / 72 / 2 >= 7  # pixels of a line of the smallest type at half size


@CHARTS
def test_runs_are_not_changed(chart):
    runs = GOOD[chart]()
    before = [{name: field.values.copy() for name, field in each.record.fields.items()} for each in runs]
    chart.figure(runs)
    for each, values in zip(runs, before, strict=True):
        assert all(np.array_equal(each.field(name), value, equal_nan=True) for name, value in values.items())


def test_every_chart_of_the_catalogue_is_tested_here():
    drawers = {chart.draw for study in STUDIES for chart in study.charts}
    assert drawers == {chart.draw for chart in GOOD} and set(OWN) <= set(GOOD)
