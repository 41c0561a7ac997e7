"""Any body recipe that a study may name has a name, a line and a marker of its own in a chart."""

import itertools

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.lines import Line2D

from massspring import Free, ImplicitVolume
from studies.plots import force_path, volume_history
from studies.plots.campaigns import recovery
from studies.plots.style.bodies import body_looks
from studies.plots.style.style import BLACK, BODY_LOOKS, SPARE_LOOKS, VERMILLION, method_colour, styled
from studies.runs.recipes import VIRTUAL
from tests.studies.plots.made_up import run

RECIPES = [
    *(
        {"kind": "tetrahedral", "recipe": {"volumes": volumes, "regions": regions, "graded": graded}}
        for graded in (False, True)
        for volumes, regions in (("scene", 32), ("whole", 32), ("nodal", 32), ("regions", 32), ("regions", 8))
    ),
    {"kind": "surface"},
    {"kind": "membrane"},
    *({"kind": "quadratic", "recipe": {"graded": graded}} for graded in (False, True, "adaptive")),
]


def named(runs, **options):
    """Name of each run's body."""
    looks = body_looks(runs, **options)
    return [looks[each.case.body].name for each in runs]


def test_every_kind_with_every_choice_of_volumes_looks_different():
    runs = [run(**chosen) for chosen in RECIPES]
    looks = list(body_looks(runs).values())
    assert [look.name for look in looks] == [each.case.body.series for each in runs]
    assert len({look.line for look in looks}) == len({look.marker for look in looks}) == len(RECIPES)
    assert len(RECIPES) == len(BODY_LOOKS) + len(SPARE_LOOKS)


def test_bodies_of_one_method_have_the_colours_of_their_families():
    mixed = body_looks([run(kind="surface"), run(), run(nodes=350), run(method=Free())])
    assert {look.colour("implicit_volume") for look in mixed.values()} == {method_colour("implicit_volume")}
    surface, coarse, fine = body_looks([run(kind="surface"), run(), run(nodes=350)]).values()
    assert surface.colour("implicit_volume") == BLACK
    assert coarse.colour("implicit_volume") == fine.colour("implicit_volume") == VERMILLION
    whole, virtual = body_looks([run(nodes=700), run(nodes=350, recipe={"cut": VIRTUAL})]).values()
    assert whole.colour("implicit_volume") == VERMILLION != virtual.colour("implicit_volume")
    (alone,) = body_looks([run()]).values()
    assert alone.colour("implicit_volume") == method_colour("implicit_volume")


@pytest.mark.parametrize(
    ("options", "names"),
    [
        ([{"law": "uniform"}, {"law": "lloyd"}], ["tetrahedral, uniform", "tetrahedral, lloyd"]),
        ([{"axis": "centre_line"}, {}], ["surface, centre line", "surface, straight"]),
        ([{}, {"weights": (1, 0.5, 2, 1)}], ["surface, default weights", "surface, weights 1:0.5:2:1"]),
    ],
)
def test_names_of_bodies_of_one_series_say_what_differs(options, names):
    kind = names[0].split(",")[0]
    runs = [run(kind=kind, recipe=chosen) for chosen in options]
    assert named(runs) == names
    assert len({look.line for look in body_looks(runs).values()}) == 2


def test_an_option_shown_in_another_way_is_left_out():
    runs = [run(nodes=nodes) for nodes in (150, 1550)]
    assert named(runs) == ["tetrahedral, 150 nodes", "tetrahedral, 1,550 nodes"]
    assert named(runs, ignored=("nodes",)) == ["tetrahedral", "tetrahedral"]


@pytest.mark.parametrize("chart", [volume_history, force_path, recovery])
def test_the_legend_shows_the_lines_that_are_drawn(chart):
    runs = [
        run(kind="tetrahedral", method=method, recipe=recipe)
        for method, recipe in itertools.product(
            (Free(), ImplicitVolume()), ({"volumes": "regions"}, {"volumes": "whole"}, {"law": "uniform"}, {})
        )
    ]
    figure = styled(chart.figure)(runs)
    entries = {
        handle.get_label(): pattern(handle) for handle in figure.legends[0].legend_handles if isinstance(handle, Line2D)
    }
    drawn = [pattern(line) for line in figure.axes[0].get_lines()]
    for name, looks in entries.items():
        if name.startswith("tetrahedral"):
            assert drawn.count(looks) == 1, name
    assert "tetrahedral, 32 volumes, free" in entries
    assert "tetrahedral, uniform, implicit volume" in entries
    assert "tetrahedral, van gelder, implicit volume" in entries


def pattern(line: Line2D):
    """Dashes in multiples of the width, and colour, of a line."""
    dashes = line._unscaled_dash_pattern[1]  # pyright: ignore[reportAttributeAccessIssue]
    return (tuple(np.round(dashes, 6)) if dashes else "-", to_hex(line.get_color()))
