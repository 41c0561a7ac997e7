"""What the charts of cost and stability say, and the picture of the squeezed ball."""

import pytest
from matplotlib.colors import to_hex

from massspring import Free, ImplicitVolume
from studies.plots import cost_ratio, frame_time, squeeze
from studies.plots.campaigns import stability
from studies.plots.style.style import BLACK, BLUE, GREY, STATUS_LOOKS, VERMILLION
from studies.store.record import Status
from tests.studies.plots.made_up import run, stability_grid
from tests.studies.plots.reading import lines, points, words


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
    assert all(status.replace("-", " ") in legend for status in Status if status not in (Status.FAILED, Status.SKIPPED))
    assert "made up to be failed" in words(stability.figure(stability_grid()))


def test_stability_counts_what_the_limit_got_wrong():
    def at(dt, status):
        return run(dt=dt, dt_limit=2e-3, status=status)

    runs = [
        at(1e-3, Status.OK),
        at(1.5e-3, Status.DIVERGED),
        at(3e-3, Status.OK),
        at(4e-3, Status.OK),
        at(5e-3, Status.DIVERGED),
    ]
    assert "Below the limit 1 of 2 runs diverge; above it 2 of 3 do not." in words(stability.figure(runs))


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
    ("worst", "bound"), [(9.6e-9, "1 × 10⁻⁶"), (8.5e-9, "9 × 10⁻⁷"), (0.0, "1 × 10⁻¹⁴"), (3.5e-4, "4 × 10⁻²")]
)
def test_squeeze_rounds_a_kept_volume_up(worst, bound):
    assert f"volume kept within {bound} %" in words(squeeze.figure([run(volume_end=worst)]))


def test_squeeze_takes_the_larger_of_two_steps():
    figure = squeeze.figure([run(dt=1e-4, volume_end=-0.02), run(dt=1e-3, volume_end=-0.03)])
    assert "−3.0 %" in words(figure)
    assert "−2.0 %" not in words(figure)


def test_a_method_s_cost_and_errors_stand_in_its_row():
    from studies.plots import methods

    runs = [run(method=Free(), frame_ms=2.0, error=0.4), run(frame_ms=1.0, error=0.1)]
    figure = methods.figure(runs)
    panels = {axes.get_xlabel(): axes for axes in figure.axes}
    drawn = points(panels[methods.COST], BLUE)
    assert [height for _, height, _ in drawn] == [0.0, 1.0]
    assert [value for value, _, _ in drawn] == pytest.approx([methods.cost(each) for each in runs])
