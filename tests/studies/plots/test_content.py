"""What charts say: numbers where they belong, never below the floor, doubtful ones marked; costs, limits, names."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.text import Text

from massspring import Free, ImplicitVolume
from studies.metrics.metric import Metric
from studies.plots import (
    accuracy,
    cost_ratio,
    force_path,
    frame_time,
    methods,
    overview,
    squeeze,
    uncertainty,
    volume_history,
)
from studies.plots import work_precision as work
from studies.plots.campaigns import stability
from studies.plots.style.page import UNRESOLVED_MARK, unresolved_notes
from studies.plots.style.style import BLACK, BLUE, GREY, ORANGE, VERMILLION, method_label
from studies.reference.uncertainty import Uncertainty
from studies.runs.case import Case
from studies.scene.library import LIVER_PRESS, LIVER_PROBE
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.store.record import Status
from tests.studies.plots.made_up import FRAMES, UNCERTAINTY, run, stability_grid
from tests.studies.plots.reading import lines, points, words


def test_volume_in_per_cent_and_its_size_below():
    upper, lower = volume_history.figure([run(method=Free(), volume_end=-0.08)]).axes
    (line,) = lines(upper, VERMILLION)
    assert line.get_ydata()[-1] == pytest.approx(-8.0)
    assert lines(lower, VERMILLION)[0].get_ydata()[-1] == pytest.approx(8.0)
    assert lower.get_yscale() == "log"
    reference = next(line for line in lines(upper, BLACK) if line.get_marker() == "o")
    assert reference.get_ydata() == pytest.approx(-3e-3 * np.array(BALL_SQUEEZE.checkpoints) / 4.0, rel=1e-6)


def test_a_chart_names_a_run_that_it_shows_and_that_is_not_ok():
    figure = volume_history.figure([run(), run(method=Free(), status=Status.SHAKEN)])
    assert "Not ok: ball_squeeze-tetrahedral-550-free-dt0.5 shaken." in words(figure)
    assert "not ok" not in words(volume_history.figure([run()]))


def test_a_diverged_run_ends_where_it_broke_and_does_not_scale_the_axis():
    broken = run(method=Free(), status=Status.DIVERGED, volume_end=1e12)
    figure = volume_history.figure([broken, run(volume_end=-0.05)])
    (line,) = lines(figure.axes[0], VERMILLION)
    assert len(line.get_xdata()) == 5
    low, high = figure.axes[0].get_ylim()
    assert -10 < low < -5
    assert high < 5


def test_the_smaller_step_is_thin_and_in_the_lower_panel_alone():
    runs = [run(volume_end=-0.02), run(volume_end=-0.01, fraction=0.05)]
    upper, lower = volume_history.figure(runs).axes
    assert len(lines(upper, BLUE)) == 1
    coarse, fine = lines(lower, BLUE)
    assert fine.get_linewidth() < coarse.get_linewidth()


def test_force_of_the_reference_holds_when_the_press_stops():
    (axes,) = force_path.figure([run()]).axes
    path, marks = (line for line in lines(axes, BLACK))
    stop = BALL_SQUEEZE.obstacles[0].path.times[-1]
    assert np.interp([stop, 4.0], path.get_xdata(), path.get_ydata()) == pytest.approx([4.0, 4.0])
    assert list(marks.get_xdata()) == list(BALL_SQUEEZE.checkpoints)
    assert "−25 %" in words(force_path.figure([run(error=0.25)]))


def test_a_chart_without_a_reference_does_not_name_one():
    alone = replace(run(), reference=None)
    for name in ("against the reference", "reference (finite elements)"):
        assert name in words(force_path.figure([run()])) and name not in words(force_path.figure([alone]))


def test_runs_that_did_not_end_ok_are_struck_out_and_named():
    sound, inverted = run(BALL_CLAMPED), run(BALL_CLAMPED, status=Status.INVERTED, method=Free())
    figure = accuracy.figure([sound, inverted])
    crosses = [line for line in lines(figure.axes[0], BLACK) if line.get_marker() == "x"]
    heights = [height for _, height, _ in points(figure.axes[0], VERMILLION)]
    assert [line.get_ydata()[0] for line in crosses] == heights and len(heights) == 4
    assert "inverted" in words(figure.legends[0]) and "struck" not in words(accuracy.figure([sound]))


@pytest.mark.parametrize("error", [0.0, 0.011, 0.3])
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


def test_a_method_costs_computing_time_per_simulated_second():
    timed = run(BALL_CLAMPED, frame_ms=2.0)
    frame = BALL_CLAMPED.duration / FRAMES
    median = 2.0 * 1.02  # the middle one of the five repeats of made_up.frame_ns
    assert methods.cost(timed) == pytest.approx(median / frame)


@pytest.mark.parametrize("chart", [accuracy, force_path, work])
def test_a_reference_that_is_not_ten_times_better_is_marked(chart):
    """Floors are 1 to 2 %: ten times better than errors of 300 %, not than those of 5 % (0.4 % of the silhouette)."""
    good, doubtful = (words(chart.figure([run(BALL_CLAMPED, error=error, frame_ms=0.5)])) for error in (3.0, 0.05))
    assert UNRESOLVED_MARK not in good and f"Ball clamped {UNRESOLVED_MARK}" in doubtful


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
    (note,) = unresolved_notes(runs, [metric(name) for name in given])
    assert note.startswith(f"{UNRESOLVED_MARK} Ball clamped") and "33 % of the force" in note
    assert "at least as large as the smallest surface" in note and "silhouette" not in note


def error_bar(order=2.0, mesh=0.01):
    return Uncertainty({"mesh": mesh, "steps": 0.0, "contact": 0.002, "kappa": 1e-3}, order, 0.005)


def test_shares_of_an_error_bar_are_drawn_where_they_are():
    figure = uncertainty.figure({"ball_squeeze": {"force": error_bar(), "interior": error_bar(float("nan"), 0.03)}})
    (panel,) = figure.axes
    assert [(x, y) for x, y, _ in points(panel, VERMILLION)] == [(pytest.approx(0.2), 0), (pytest.approx(0.2), 1)]
    assert [x for x, _, _ in points(panel, BLUE)] == pytest.approx([1.0, 3.0])
    assert [hollow for _, _, hollow in points(panel, BLUE)] == [False, True]  # the second is a spread
    assert [x for x, _, _ in points(panel, ORANGE)] == [uncertainty.LOWEST] * 2
    assert f"{100 * error_bar().total:.2g}" in words(figure)


def test_error_bars_stand_in_the_row_of_their_name():
    """A scene that allows fewer quantities leaves rows empty; it does not move up into another's."""
    names = ("force", "surface", "silhouette")
    full, part = {name: error_bar() for name in names}, {name: error_bar(mesh=0.02) for name in ("force", "silhouette")}
    few, all_of_them = uncertainty.figure({"ball_squeeze": part, "ball_clamped": full}).axes
    assert [label.get_text() for label in few.get_yticklabels()] == list(names)
    assert [names[int(y)] for _, y, _ in points(few, BLUE)] == ["force", "silhouette"]
    assert [names[int(y)] for _, y, _ in points(all_of_them, BLUE)] == list(names)


def test_frame_times_with_deadlines_and_percentiles():
    figure = frame_time.figure([run(frame_ms=0.5)])
    history, strip = (a for a in figure.findobj(lambda artist: hasattr(artist, "get_ylabel")) if a.axison)
    across = {float(line.get_ydata()[0]) for line in history.get_lines() if to_hex(line.get_color()) == GREY.lower()}
    assert across == {1.0, 2.0, 33.0}
    assert history.get_yscale() == strip.get_xscale() == "log"
    marks = [float(line.get_xdata()[0]) for line in lines(strip, BLUE) if len(line.get_xdata()) == 1]
    assert marks[0] == pytest.approx(0.51)
    assert marks[-1] == pytest.approx(1.5 * 1.04)


def test_cost_ratio_and_its_interval():
    (row,) = cost_ratio.ratios([run(frame_ms=1.0, method=Free()), run(frame_ms=1.25)])
    assert row[1] == "implicit_volume"
    assert row[2].median == pytest.approx(1.25)
    figure = cost_ratio.figure([run(frame_ms=1.0, method=Free()), run(frame_ms=1.25)])
    assert 1.0 in [float(line.get_xdata()[0]) for line in lines(figure.axes[0], BLACK)]
    assert cost_ratio.ratios([run(frame_ms=1.0, method=Free(), nodes=150), run(frame_ms=1.25, nodes=550)]) == []


def test_a_ratio_that_cannot_be_resolved_is_grey_and_says_so():
    figure = cost_ratio.figure([run(frame_ms=1.0, method=Free()), run(frame_ms=1.0)])
    (axes,) = figure.axes
    assert "not resolvable" in words(axes)
    assert points(axes, BLUE) == []
    assert points(axes, GREY)[0][2]


@pytest.mark.parametrize("chart", [frame_time, cost_ratio, work, methods, overview])
@pytest.mark.parametrize(("cpu", "marked"), [(0.97, False), (0.8, True)])
def test_times_name_the_processor_and_are_marked_without_a_spread_where_the_program_waited(chart, cpu, marked):
    pair = [run(frame_ms=ms, cpu=cpu, method=method) for ms, method in ((1.0, Free()), (1.25, ImplicitVolume()))]
    figure = chart.figure(pair)
    said = " ".join(text.get_text().replace("\n", " ") for text in figure.findobj(Text))
    assert "Z80" in said and f"{100 * cpu:.0f} %" in said
    assert ("disturbed the timing" in said) == marked and ("¶" in said) == marked
    if chart is cost_ratio:
        assert ("1.25  (1.25 to 1.25)" in said) == (not marked)


def test_stability_shows_every_status_by_marker_and_colour_and_the_limit():
    figure = stability.figure([each for each in stability_grid() if each.case.method.name == ImplicitVolume.name])
    panel = figure.axes[0]
    limit = next(line for line in lines(panel, BLACK) if line.get_marker() == ".")
    assert limit.get_xdata() == pytest.approx([6.0, 1.5])  # ms: 3 ms over the root of the factor
    assert list(limit.get_ydata()) == [0.25, 4.0]
    assert "made up to be failed" in words(stability.figure(stability_grid()))


def test_stability_counts_what_the_limit_got_wrong():
    good, bad = Status.OK, Status.DIVERGED
    steps = ((1e-3, good), (1.5e-3, bad), (3e-3, good), (4e-3, good), (5e-3, bad))
    runs = [run(dt=dt, dt_limit=2e-3, status=status) for dt, status in steps]
    assert "1 of 2 runs diverge; above it 2 of 3 do not" in words(stability.figure(runs))


def test_squeeze_shows_rest_both_methods_and_the_reference_with_their_numbers():
    figure = squeeze.figure([run(method=Free(), volume_end=-0.081, error=0.5), run(volume_end=2.5e-8, error=0.3)])
    rest, free, kept, reference = (words(axes) for axes in figure.axes)
    assert "−8.1 %" in free and "(−50 %)" in free and "4.00 N (± 2 %)" in reference
    assert "kept within 3 × 10⁻⁶ %" in kept and "(−30 %)" in kept and "%" not in rest
    assert len({(*axes.get_xlim(), *axes.get_ylim()) for axes in figure.axes}) == 1  # one scale


@pytest.mark.parametrize(
    ("worst", "bound"), [(9.6e-9, "1 × 10⁻⁶"), (8.5e-9, "9 × 10⁻⁷"), (0.0, "1 × 10⁻¹⁴"), (3.5e-4, "4 × 10⁻²")]
)
def test_squeeze_rounds_a_kept_volume_up(worst, bound):
    assert f"volume kept within {bound} %" in words(squeeze.figure([run(volume_end=worst)]))


def test_squeeze_takes_the_larger_of_two_steps():
    figure = squeeze.figure([run(dt=1e-4, volume_end=-0.02), run(dt=1e-3, volume_end=-0.03)])
    assert "−3.0 %" in words(figure)
    assert "−2.0 %" not in words(figure)


def test_a_method_s_cost_and_errors_stand_in_its_row():
    runs = [run(method=Free(), frame_ms=2.0, error=0.4), run(frame_ms=1.0, error=0.1)]
    figure = methods.figure(runs)
    panels = {axes.get_xlabel(): axes for axes in figure.axes}
    drawn = points(panels[methods.COST], BLUE)
    assert [height for _, height, _ in drawn] == [0.0, 1.0]
    assert [value for value, _, _ in drawn] == pytest.approx([methods.cost(each) for each in runs])


def title_of(scene, nodes):
    """Of the panel of a scene whose reference has these nodes (n, 3) [m]; None: no reference."""
    made = run(scene, method=Free(), with_reference=nodes is not None)
    if nodes is not None:
        before = made.reference.field
        made.reference.field = lambda name: nodes if name == "nodes" else before(name)  # type: ignore[method-assign]
    return force_path.figure([made]).axes[0].get_title()


@pytest.mark.parametrize(("scene", "deep"), [(LIVER_PRESS, 20), (LIVER_PROBE, 10)])
def test_the_depth_is_that_of_the_scene_not_the_way_of_the_press(scene, deep):
    press = scene.obstacles[0]
    start, way = press.anchor, np.array(press.path.displacements[-1])
    ahead = way / np.linalg.norm(way)
    touched = start + (getattr(press, "radius", 0.0) + np.linalg.norm(way) - deep * 1e-3) * ahead
    assert f", {deep} mm in 6 s" in title_of(scene, np.array([touched, touched + 0.05 * ahead]))


def test_the_first_touch_of_an_octant_may_lie_in_another_eighth():
    assert ", 2 × 15 mm in" in title_of(BALL_SQUEEZE, np.array([[0.0, 0.0, 0.05], [0.05, 0.0, 0.0]]))


def test_own_methods_keep_their_names_in_legends():
    assert method_label("implicit_volume") == "implicit volume" and method_label("lbfgs_nh") == "lbfgs_nh"
    made = run(LIVER_PRESS)
    own = SimpleNamespace(name="lbfgs_nh")
    case = Case(LIVER_PRESS, made.case.body, Free())
    object.__setattr__(case, "method", own)
    sheet = force_path.figure([type(made)(case, made.record, made.reference)])
    assert any("lbfgs_nh" in text.get_text() for legend in sheet.legends for text in legend.get_texts())
