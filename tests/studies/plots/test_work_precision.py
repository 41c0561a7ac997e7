"""What the chart of accuracy for computing time says: where points lie, what is best for the time, what is named."""

import itertools

import numpy as np
import pytest
from matplotlib.colors import to_hex

from massspring import LITERATURE, ExplicitElements, Free, ImplicitElements
from studies.meshing.true_surface import ShapeErrors
from studies.metrics.judged import front
from studies.metrics.table import metric
from studies.plots import work_precision as work
from studies.plots.style.families import CONTESTANTS, FAMILIES, PAPER, VIRTUAL_NODES, family_of
from studies.plots.style.style import BLACK, BLUE, GREY, VERMILLION
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.library.liver_press import LIVER_PRESS
from studies.store.record import Status
from tests.studies.plots.made_up import FRAMES, UNCERTAINTY, run
from tests.studies.plots.reading import words


@pytest.fixture(autouse=True)
def in_shape(monkeypatch):
    """An octahedron has the shape of every organ: what is drawn is the point here."""
    monkeypatch.setattr("studies.metrics.run.shape_errors", lambda *given, **options: ShapeErrors(0.0, 0.0))


def at(cost, error, scene=BALL_CLAMPED, kind="tetrahedral", **options):
    """A run of so much computing over simulated time; the middle one of its five repeats is 1.02 times as slow."""
    frame_ms = cost * 1e3 * scene.duration / FRAMES / 1.02
    return run(scene, kind, error=error, frame_ms=frame_ms, **options)


LADDER = (
    at(0.01, 0.7, kind="surface"),
    at(0.03, 0.3),
    at(0.2, 0.05, kind="quadratic", nodes=594),
    at(0.6, 0.025, kind="quadratic", nodes=794, recipe={"graded": True}),
    at(0.9, 0.2, recipe={"volumes": "nodal", "law": "cotangent"}),
)


def markers(axes, marker):
    """(x, y) of the points of one family, whatever their error bars."""
    lines = [line for line in axes.get_lines() if line.get_marker() == marker and line.get_markerfacecolor() != "none"]
    return [(float(line.get_xdata()[0]), float(line.get_ydata()[0])) for line in lines if len(line.get_xdata()) == 1]


def test_points_lie_at_cost_and_error_of_force_and_displacement():
    force, displacement = work.figure(LADDER).axes
    assert markers(force, "s") == [(pytest.approx(0.01), pytest.approx(70.0))]
    assert markers(displacement, "s") == [(pytest.approx(0.01), pytest.approx(metric("mean_error")(LADDER[0])))]
    assert force.get_xscale() == force.get_yscale() == displacement.get_yscale() == "log"


def test_error_bars_are_the_reference_s_uncertainty_and_the_spread_of_repeats():
    (axes, _) = work.figure(LADDER[1:2]).axes
    across, up = (collection.get_segments()[0] for collection in axes.collections[-2:])
    assert np.ptp(up[:, 1]) == pytest.approx(2 * 100 * UNCERTAINTY["force_end"])
    assert np.ptp(across[:, 0]) == pytest.approx(0.03 * 0.04 / 1.02)


def test_nothing_is_drawn_below_the_uncertainty():
    (axes, _) = work.figure([at(0.1, 0.0)]).axes
    assert markers(axes, "o") == [(pytest.approx(0.1), pytest.approx(100 * UNCERTAINTY["force_end"]))]


def test_the_front_joins_what_nothing_beats():
    assert front([(1, 5), (2, 3), (3, 4), (0.5, 9), (4, 3)]) == [(0.5, 9), (1, 5), (2, 3)]
    (axes, _) = work.figure(LADDER).axes
    (line,) = [each for each in axes.get_lines() if to_hex(each.get_color()) == GREY.lower()]
    assert list(line.get_xdata()) == pytest.approx([0.01, 0.03, 0.2, 0.6])


def test_real_time_half_of_it_and_the_goal_are_drawn():
    force, displacement = work.figure(LADDER).axes
    upright = [
        float(line.get_xdata()[0])
        for line in force.get_lines()
        if len(line.get_xdata()) == 2 and line.get_xdata()[0] == line.get_xdata()[1]
    ]
    assert upright == [1.0, 0.5]
    for axes, bound in ((force, 3.0), (displacement, 1.0)):
        corner = axes.collections[0].get_paths()[0].get_extents()
        assert (corner.x1, corner.y1) == pytest.approx((1.0, bound))


def test_the_paper_s_body_and_what_is_recommended_are_named():
    accurate = at(0.7, 0.005, kind="quadratic", nodes=1194, recipe={"graded": True})
    figure = work.figure([*LADDER, accurate])
    assert all(PAPER in words(axes) and "recommended" in words(axes) for axes in figure.axes)
    rings = [line for line in figure.axes[0].get_lines() if line.get_markerfacecolor() == "none"]
    assert [float(line.get_xdata()[0]) for line in rings] == [pytest.approx(0.7)]


def test_a_run_that_ended_with_a_fault_is_no_point():
    faulty = at(0.1, 0.1, status=Status.INVERTED)
    figure = work.figure([LADDER[0], faulty, run(BALL_CLAMPED, nodes=99)])
    assert markers(figure.axes[0], "o") == []
    text = words(figure).replace("\n", " ")
    assert f"{faulty.case.name} inverted" in text and "no frame times for this machine and code version): 1." in text


def test_families_differ_without_colour():
    looks = [*FAMILIES.values(), VIRTUAL_NODES, *CONTESTANTS.values()]
    assert len({look.marker for look in looks}) == len({look.colour for look in looks}) == len(looks)
    assert family_of(LADDER[0].case).colour == BLACK and family_of(LADDER[1].case).colour == VERMILLION
    assert family_of(LADDER[3].case).colour == BLUE
    contest = [
        *itertools.product(("tetrahedral", "quadratic"), (ExplicitElements, ImplicitElements)),
        *zip(("tetrahedral", "tetrahedral", "quadratic", "quadratic"), LITERATURE, strict=True),
    ]
    for kind, method in contest:
        drawn = at(0.5, 0.1, kind=kind, method=method(), nodes=594)
        look, figure = family_of(drawn.case), work.figure([drawn])
        assert look.colour != GREY and look.name in words(figure) and len(markers(figure.axes[0], look.marker)) == 1
    other = family_of(run(LIVER_PRESS, method=Free()).case)
    assert other.colour == GREY and other.name == "tetrahedral, free"


def test_every_point_of_a_row_is_in_sight():
    figure = work.figure([at(0.1, 0.9), at(0.1, 0.05, scene=LIVER_PRESS)])
    assert all(axes.get_ylim()[1] > 90.0 for axes in figure.axes[:2])


def test_nothing_is_recommended_that_the_reference_cannot_tell():
    accurate = at(0.7, 0.005, kind="quadratic")
    accurate.reference.total_uncertainty["surface_mean"] = 0.02
    assert "recommended" not in words(work.figure([accurate]).axes[0])
