"""What the charts say: numbers where they belong, never below the floor, doubtful ones marked as such."""

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.text import Text

from massspring import Free, ImplicitVolume
from studies.plots import accuracy, cost_ratio, force_path, frame_time, squeeze, stability, volume_history
from studies.plots import work_precision as work
from studies.plots.style import BLACK, BLUE, GREY, STATUS_LOOKS, VERMILLION
from studies.scenes.ball_clamped import BALL_CLAMPED
from studies.scenes.ball_squeeze import BALL_SQUEEZE
from studies.store import Status
from tests.plots.made_up import FLOOR, FRAMES, frame_ns, run, stability_grid, timed_grid


def words(figure):
    """Everything that is written."""
    return "\n".join(text.get_text() for text in figure.findobj(Text) if text.get_visible())


def lines(axes, colour):
    """Lines of one colour with data."""
    return [line for line in axes.get_lines() if to_hex(line.get_color()) == colour.lower() and len(line.get_xdata())]


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


def test_a_missing_reference_is_said():
    said = "No reference for ball squeeze"
    assert said in words(volume_history.figure([run(with_reference=False)]))
    assert said in words(accuracy.figure([run(with_reference=False)]))
    assert said not in words(volume_history.figure([run()]))


def test_the_smaller_step_is_thin_and_in_the_lower_panel_alone():
    runs = [run(volume_end=1e-8), run(volume_end=1e-9, fraction=0.05)]
    upper, lower = volume_history.figure(runs).axes
    assert len(lines(upper, BLUE)) == 1
    coarse, fine = lines(lower, BLUE)
    assert fine.get_linewidth() < coarse.get_linewidth()
    assert "smaller time step" in words(volume_history.figure(runs).legends[0])


@pytest.mark.parametrize(("error", "said"), [(0.25, "−25 %"), (-0.1, "+10 %")])
def test_force_error_stands_at_the_end_of_its_line(error, said):
    assert said in words(force_path.figure([run(error=error)]))


def test_force_of_the_reference_holds_when_the_press_stops():
    (axes,) = force_path.figure([run()]).axes
    path, marks = (line for line in lines(axes, BLACK))
    stop = BALL_SQUEEZE.obstacles[0].path.times[-1]
    assert np.interp([stop, 4.0], path.get_xdata(), path.get_ydata()) == pytest.approx([4.0, 4.0])
    assert list(marks.get_xdata()) == list(BALL_SQUEEZE.checkpoints)
    assert "15 mm in 3 s" in axes.get_title()


def points(axes, colour):
    """(x, y, hollow) of single markers."""
    return [
        (float(line.get_xdata()[0]), float(line.get_ydata()[0]), line.get_markerfacecolor() == "white")
        for line in lines(axes, colour)
        if len(line.get_xdata()) == 1 and line.get_marker() != "None"
    ]


@pytest.mark.parametrize("error", [0.0, 1e-4, 0.011, 0.05, 0.3])
def test_accuracy_never_below_the_floor_and_hollow_where_the_floor_matters(error):
    (axes,) = accuracy.figure([run(BALL_CLAMPED, error=error)]).axes
    floors = [100 * FLOOR[name] for name in ("force", "surface", "interior", "silhouette")]
    found = points(axes, BLUE)
    assert len(found) == 4
    for (_, height, hollow), floor in zip(found, floors, strict=True):
        assert height >= floor
        assert hollow == (floor > 0.1 * height or height == floor)
    assert found[0][1] == pytest.approx(max(100 * error, floors[0]))
    shades = [patch.get_extents().y1 for patch in axes.collections[0].get_paths()]
    assert shades == pytest.approx(floors[:1])


def test_accuracy_leaves_out_what_a_scene_does_not_allow():
    (axes,) = accuracy.figure([run(BALL_SQUEEZE)]).axes
    assert sorted({round(x) for x, _, _ in points(axes, BLUE)}) == [0, 3]
    assert words(axes).count("not\ncompared") == 2


@pytest.mark.parametrize("error", [0.0, 0.3])
def test_work_precision_never_below_the_floor(error):
    figure = work.figure(
        [run(BALL_CLAMPED, error=error, frame_ms=0.5), run(BALL_CLAMPED, error=error, nodes=99, frame_ms=1)]
    )
    for axes, name in zip(figure.axes, ("force", "interior"), strict=True):
        floor = 100 * FLOOR[name]
        drawn = np.concatenate([line.get_ydata() for line in lines(axes, BLUE)])
        assert (drawn >= floor).all()
        assert drawn == pytest.approx(max(100 * error, floor))
        assert axes.patches[0].get_y() + axes.patches[0].get_height() == pytest.approx(floor)


def test_work_precision_costs_computing_time_per_simulated_second():
    timed = run(BALL_CLAMPED, frame_ms=2.0)
    frame = BALL_CLAMPED.duration / FRAMES
    median = 2.0 * 1.02  # the middle one of the five repeats of made_up.frame_ns
    assert work.cost(timed) == pytest.approx(median / frame)


def test_work_precision_lines_join_meshes_of_one_method_and_step():
    figure = work.figure(timed_grid())
    joined = [line for line in figure.axes[0].get_lines() if len(line.get_xdata()) == 2 and line.get_marker() == "None"]
    assert len(joined) == 4  # two methods, two steps; two meshes each
    assert "150" in words(figure.axes[0])


def test_work_precision_marks_a_run_that_ended_with_a_fault():
    figure = work.figure([run(BALL_CLAMPED, frame_ms=1.0, status=Status.INVERTED)])
    assert points(figure.axes[0], BLUE)[0][2]
    assert "ended inverted" in words(figure.legends[0])


def test_frame_times_with_deadlines_and_percentiles():
    figure = frame_time.figure([run(frame_ms=0.5)])
    history, strip = (a for a in figure.findobj(lambda artist: hasattr(artist, "get_ylabel")) if a.axison)
    across = {float(line.get_ydata()[0]) for line in history.get_lines() if to_hex(line.get_color()) == GREY.lower()}
    assert across == {1.0, 2.0, 33.0}
    assert history.get_yscale() == strip.get_xscale() == "log"
    marks = [float(line.get_xdata()[0]) for line in lines(strip, BLUE) if len(line.get_xdata()) == 1]
    assert marks[0] == pytest.approx(0.51)
    assert marks[-1] == pytest.approx(1.5 * 1.04)
    assert all(f"{deadline} ms" in words(figure) for deadline in (33, 2, 1))


def test_cost_ratio_and_its_interval():
    (row,) = cost_ratio.ratios([run(frame_ms=1.0, method=Free()), run(frame_ms=1.25)])
    assert row[1] == "implicit_volume"
    assert row[2].median == pytest.approx(1.25)
    figure = cost_ratio.figure([run(frame_ms=1.0, method=Free()), run(frame_ms=1.25)])
    assert "1.25" in words(figure)
    assert 1.0 in [float(line.get_xdata()[0]) for line in lines(figure.axes[0], BLACK)]


def test_cost_ratio_pairs_only_what_differs_by_method():
    assert cost_ratio.ratios([run(frame_ms=1.0, method=Free(), nodes=150), run(frame_ms=1.25, nodes=550)]) == []


def test_a_ratio_that_cannot_be_resolved_is_grey_and_says_so():
    figure = cost_ratio.figure([run(frame_ms=1.0, method=Free()), run(frame_ms=1.0)])
    (axes,) = figure.axes
    assert "not resolvable" in words(axes)
    assert points(axes, BLUE) == []
    assert points(axes, GREY)[0][2]


def test_stability_shows_every_status_by_marker_and_colour_and_the_limit():
    figure = stability.figure([each for each in stability_grid() if each.case.method.name == ImplicitVolume.name])
    panel = figure.axes[0]
    limit = next(line for line in lines(panel, BLACK) if line.get_marker() == ".")
    assert limit.get_xdata() == pytest.approx([6.0, 1.5])  # ms: 3 ms over the root of the factor
    assert list(limit.get_ydata()) == [0.25, 4.0]
    legend = words(stability.figure(stability_grid()).legends[0])
    assert all(status.replace("-", " ") in legend for status in Status if status != Status.FAILED)
    assert "made up to be failed" in words(stability.figure(stability_grid()))


def test_stability_counts_what_the_limit_got_wrong():
    def at(dt, status):
        return run(dt=dt, dt_limit=2e-3, status=status)

    runs = [at(1e-3, Status.OK), at(1.5e-3, Status.DIVERGED), at(3e-3, Status.OK), at(4e-3, Status.DIVERGED)]
    assert "Below the limit 1 of 2 runs diverge; above it 1 of 2 do not." in words(stability.figure(runs))


def test_statuses_and_methods_have_looks_of_their_own():
    assert set(STATUS_LOOKS) == set(Status)
    colours = [colour for colour, _ in STATUS_LOOKS.values()]
    assert len({*colours, BLUE, VERMILLION}) == len(Status) + 2
    assert len({marker for _, marker in STATUS_LOOKS.values()}) == len(Status)


def test_squeeze_shows_rest_both_methods_and_the_reference_with_their_numbers():
    figure = squeeze.figure([run(method=Free(), volume_end=-0.081, error=0.5), run(volume_end=2.5e-8, error=0.3)])
    assert len(figure.axes) == 4
    free, kept = (words(axes) for axes in figure.axes[1:3])
    assert "volume −8.1 %" in free
    assert "(−50 %)" in free
    assert "kept within 3 × 10⁻⁶ %" in kept
    assert "(−30 %)" in kept
    assert "4.00 N (± 2 %)" in words(figure.axes[3])
    windows = {(*axes.get_xlim(), *axes.get_ylim()) for axes in figure.axes}
    assert len(windows) == 1  # one scale


@pytest.mark.parametrize(
    ("worst", "said"), [(9.6e-9, "1 × 10⁻⁶"), (8.5e-9, "9 × 10⁻⁷"), (0.0, "1 × 10⁻¹⁴"), (3.5e-4, "4 × 10⁻²")]
)
def test_squeeze_rounds_a_kept_volume_up(worst, said):
    assert f"volume kept within {said} %" in words(squeeze.figure([run(volume_end=worst)]))


def test_squeeze_takes_the_larger_of_two_steps():
    figure = squeeze.figure([run(dt=1e-4, volume_end=-0.02), run(dt=1e-3, volume_end=-0.03)])
    assert "−3.0 %" in words(figure)
    assert "−2.0 %" not in words(figure)


def test_made_up_frames_are_what_the_tests_above_think():
    times = frame_ns(1.0)
    assert times.shape == (5, FRAMES)
    assert np.median(times) == pytest.approx(1.02e6)
