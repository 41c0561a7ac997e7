"""What the charts of accuracy say: numbers where they belong, never below the floor, doubtful ones marked."""

import numpy as np
import pytest

from massspring import Free
from studies.metrics.metric import Metric
from studies.plots import accuracy, force_path, methods, uncertainty, volume_history
from studies.plots import work_precision as work
from studies.plots.style.page import UNRESOLVED_MARK, unresolved_notes
from studies.plots.style.style import BLACK, BLUE, ORANGE, VERMILLION
from studies.reference.uncertainty import Uncertainty
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.store.record import Status
from tests.studies.plots.made_up import FRAMES, UNCERTAINTY, run
from tests.studies.plots.reading import lines, points, words


def test_volume_in_per_cent_and_its_size_below():
    upper, lower = volume_history.figure([run(method=Free(), volume_end=-0.08)]).axes
    (line,) = lines(upper, VERMILLION)
    assert line.get_ydata()[-1] == pytest.approx(-8.0)
    assert lines(lower, VERMILLION)[0].get_ydata()[-1] == pytest.approx(8.0)
    assert lower.get_yscale() == "log"
    reference = next(line for line in lines(upper, BLACK) if line.get_marker() == "o")
    assert reference.get_ydata() == pytest.approx(-3e-3 * np.array(BALL_SQUEEZE.checkpoints) / 4.0, rel=1e-6)


def test_a_diverged_run_ends_where_it_broke_and_does_not_scale_the_axis():
    broken = run(method=Free(), status=Status.DIVERGED, volume_end=1e12)
    figure = volume_history.figure([broken, run(volume_end=-0.05)])
    (line,) = lines(figure.axes[0], VERMILLION)
    assert len(line.get_xdata()) == 5
    low, high = figure.axes[0].get_ylim()
    assert -10 < low < -5
    assert high < 5
    assert "diverged; shown up to there" in words(figure)


def test_the_smaller_step_is_thin_and_in_the_lower_panel_alone():
    runs = [run(volume_end=-0.02), run(volume_end=-0.01, fraction=0.05)]
    upper, lower = volume_history.figure(runs).axes
    assert len(lines(upper, BLUE)) == 1
    coarse, fine = lines(lower, BLUE)
    assert fine.get_linewidth() < coarse.get_linewidth()
    assert "smaller time step" in words(volume_history.figure(runs).legends[0])


@pytest.mark.parametrize(("error", "label"), [(0.25, "−25 %"), (-0.1, "+10 %"), (0.0042, "−0.4 %"), (0.0004, "0.0 %")])
def test_force_error_stands_at_the_end_of_its_line(error, label):
    assert label in words(force_path.figure([run(error=error)]))


def test_force_of_the_reference_holds_when_the_press_stops():
    (axes,) = force_path.figure([run()]).axes
    path, marks = (line for line in lines(axes, BLACK))
    stop = BALL_SQUEEZE.obstacles[0].path.times[-1]
    assert np.interp([stop, 4.0], path.get_xdata(), path.get_ydata()) == pytest.approx([4.0, 4.0])
    assert list(marks.get_xdata()) == list(BALL_SQUEEZE.checkpoints)
    assert "15 mm in 3 s" in axes.get_title()


def test_runs_that_did_not_end_ok_are_struck_out_and_named():
    sound, inverted = run(BALL_CLAMPED), run(BALL_CLAMPED, status=Status.INVERTED, method=Free())
    figure = accuracy.figure([sound, inverted])
    crosses = [line for line in lines(figure.axes[0], BLACK) if line.get_marker() == "x"]
    heights = [height for _, height, _ in points(figure.axes[0], VERMILLION)]
    assert [line.get_ydata()[0] for line in crosses] == heights and len(heights) == 4
    assert "struck out: inverted, no sound result" in words(figure.legends[0])
    assert "struck out" not in words(accuracy.figure([sound]))


@pytest.mark.parametrize("error", [0.0, 1e-4, 0.011, 0.05, 0.3])
def test_accuracy_never_below_the_floor_and_hollow_where_the_floor_matters(error):
    (axes,) = accuracy.figure([run(BALL_CLAMPED, error=error)]).axes
    bounds = [100 * UNCERTAINTY[name] for name in ("force", "surface", "interior", "silhouette")]
    marks = points(axes, BLUE)
    assert len(marks) == 4
    for (_, height, hollow), bound in zip(marks, bounds, strict=True):
        assert height >= bound
        assert hollow == (bound > 0.1 * height or height == bound)
    assert marks[0][1] == pytest.approx(max(100 * error, bounds[0]))
    shades = [patch.get_extents().y1 for patch in axes.collections[0].get_paths()]
    assert shades == pytest.approx(bounds[:1])


def test_accuracy_leaves_out_what_a_scene_does_not_allow():
    (axes,) = accuracy.figure([run(BALL_SQUEEZE)]).axes
    assert sorted({round(x) for x, _, _ in points(axes, BLUE)}) == [0, 3]
    assert words(axes).count("not\ncompared") == 2


def test_a_method_costs_computing_time_per_simulated_second():
    timed = run(BALL_CLAMPED, frame_ms=2.0)
    frame = BALL_CLAMPED.duration / FRAMES
    median = 2.0 * 1.02  # the middle one of the five repeats of made_up.frame_ns
    assert methods.cost(timed) == pytest.approx(median / frame)


@pytest.mark.parametrize("chart", [accuracy, force_path, work])
def test_a_reference_that_is_not_ten_times_better_is_marked(chart):
    """Floors are 1 to 2 %: ten times better than errors of 300 %, not than those of 5 % (0.4 % of the silhouette)."""

    def text(error):
        return words(chart.figure([run(BALL_CLAMPED, error=error, frame_ms=0.5)]))

    assert UNRESOLVED_MARK not in text(3.0)
    assert f"Ball clamped {UNRESOLVED_MARK}" in text(0.05)
    note = text(0.05).split(f"{UNRESOLVED_MARK} Ball clamped: the uncertainty of the reference is ")[1]
    assert note.startswith(("up to", "at least as large as"))
    assert "force" in note


def test_a_note_gives_each_metric_the_share_of_its_own_smallest_error():
    """The force is known to a third of its error, the surface no better than the smaller of its two errors, and the
    silhouette well enough."""
    given = {"force": (30.0, 60.0), "surface": (5.0, 40.0), "silhouette": (200.0, 300.0)}
    bars = {"force": 10.0, "surface": 6.0, "silhouette": 1.0}

    def metric(name):
        return Metric(f"{name}_error", "%", "lower", lambda one: given[name][one is not runs[0]], name)

    runs = [run(BALL_CLAMPED, error=error) for error in (0.1, 0.2)]
    for one in runs:
        one.reference.total_uncertainty.update({name: bar / 100 for name, bar in bars.items()})
    assert unresolved_notes(runs, [metric(name) for name in given]) == [
        f"{UNRESOLVED_MARK} Ball clamped: the uncertainty of the reference is up to 33 % of the force error, "
        "at least as large as the smallest surface error."
    ]


def error_bar(order=2.0, mesh=0.01):
    return Uncertainty({"mesh": mesh, "steps": 0.0, "contact": 0.002, "kappa": 1e-3}, order, 0.005)


def test_shares_of_an_error_bar_are_drawn_where_they_are():
    figure = uncertainty.figure({"ball_squeeze": {"force": error_bar(), "interior": error_bar(float("nan"), 0.03)}})
    (panel,) = figure.axes
    assert [(x, y) for x, y, _ in points(panel, VERMILLION)] == [(pytest.approx(0.2), 0), (pytest.approx(0.2), 1)]
    mesh = points(panel, BLUE)
    assert [x for x, _, _ in mesh] == pytest.approx([1.0, 3.0])
    assert [hollow for _, _, hollow in mesh] == [False, True]  # the second is a spread
    assert [x for x, _, _ in points(panel, ORANGE)] == [uncertainty.LOWEST] * 2
    assert f"{100 * error_bar().total:.2g}" in words(figure)
    assert [label.get_text() for label in panel.get_yticklabels()] == ["force", "interior"]
    assert panel.get_ylim()[0] > panel.get_ylim()[1]
    assert "Observed order 2." in words(figure)


def test_error_bars_stand_in_the_row_of_their_name():
    """A scene that allows fewer quantities leaves rows empty; it does not move up into another's."""
    names = ("force", "surface", "silhouette")
    full, part = {name: error_bar() for name in names}, {name: error_bar(mesh=0.02) for name in ("force", "silhouette")}
    figure = uncertainty.figure({"ball_squeeze": part, "ball_clamped": full})
    few, all_of_them = figure.axes
    assert [label.get_text() for label in few.get_yticklabels()] == list(names)
    assert [names[int(y)] for _, y, _ in points(few, BLUE)] == ["force", "silhouette"]
    assert [names[int(y)] for _, y, _ in points(all_of_them, BLUE)] == list(names)
