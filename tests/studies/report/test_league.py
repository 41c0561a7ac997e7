"""Profiles count what a reader would count by hand; the page shows every engine, every number and every reason."""

import json
import re

import numpy as np
import pytest

from studies.exchange.league import SET, frozen
from studies.plots.campaigns.league import figure
from studies.reference.published import published
from studies.report.league import COST, COUNT, HEADS, cards, engines, page, pairs, profile, profiles, tolerance
from studies.report.page.write import write_page
from studies.scene.library import LIVER_PRESS
from tests.studies.report.page.made_up_page import made_up_parts

NAN = float("nan")


def row(engine, scene, force, mean, cost, **more):
    """Of an engine: the uncertainty of its force is 0.5 %, that of its displacement 0.1 %."""
    values = {
        "force_end": (force, 0.5),
        "mean_error": (mean, 0.1),
        "volume_worst": (0.2, NAN),
        "penetration": (0.0, NAN),
    }
    made = {"engine": engine, "version": "1.0", "ours": engine == "mine", "scene": scene, "mesh": "straight"}
    made |= {"nodes": 150, "status": "ok", "message": "", "settings": "{}", COST: cost, COUNT: NAN}
    for name, (value, floor) in values.items():
        made |= {f"{name} [%]": value, f"{name} floor [%]": floor}
    return made | more


LOST = {f"{name} {kind}[%]": NAN for name in HEADS for kind in ("", "floor ")}
ROWS = [
    row("a", "ball_squeeze", -2.0, NAN, 0.5),
    row("a", "liver_press", 8.0, 0.9, 2.0),
    row("a", "liver_press", 2.9, 0.8, 20.0, nodes=300),
    row("b", "ball_squeeze", 40.0, NAN, 0.1),
    row("b", "liver_press", NAN, NAN, NAN, status="skipped", message="b: no <planes>", **LOST),
    row("mine", "liver_press", 0.4, 3.0, 1.0),
]


SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><g/></svg>'
BARS = {("ball_squeeze", "force_end"): 0.5, ("liver_press", "force_end"): 0.5, ("liver_press", "mean_error"): 0.1}


def test_pairs_are_those_of_the_open_scenes_with_the_bars_of_their_references():
    """A ball between planes may turn: its displacement is no pair."""
    bars = pairs()
    assert len(bars) == 9 and ("ball_squeeze", "mean_error") not in bars
    reference = published(LIVER_PRESS)
    assert reference is not None
    references = json.loads((reference.file.parent / "set.json").read_text())["references"]
    published_bars = references["liver_press"]["relative bars"]
    assert bars["liver_press", "force_end"] == pytest.approx(100 * published_bars["force_end"])
    assert bars["liver_press", "mean_error"] == pytest.approx(100 * published_bars["surface_mean"])


def test_a_profile_is_counted_by_hand():
    """Of three pairs, a has the force of the ball for 0.5, the displacement for 2, the force of the liver for 20."""
    assert profile(ROWS, "a", 1.0, BARS) == [(0.5, 1 / 3), (2.0, 2 / 3), (20.0, 1.0)]
    assert profile(ROWS, "a", 3.0, BARS) == [(0.5, 1 / 3), (2.0, 2 / 3), (2.0, 1.0)]
    assert profile(ROWS, "b", 3.0, BARS) == []
    assert profile(ROWS, "mine", 1.0, BARS) == [(1.0, 1 / 3)] and profile(ROWS, "mine", 3.0, BARS)[-1] == (1.0, 2 / 3)
    assert profile(ROWS, "a", 1.0, BARS, COUNT) == []
    # 0.01 of 3 % is less than the uncertainty of the reference, 0.5 %.
    assert tolerance("force_end", 0.01, 0.5) == 0.5 and tolerance("force_end", 1.0, 0.5) == 3.0
    assert profile(ROWS, "mine", 0.01, BARS) == [(1.0, 1 / 3)]


def test_cards_say_the_range_and_the_reasons():
    a, b, mine = cards(ROWS)
    assert engines(ROWS) == ["a", "b", "mine"] == [one["engine"] for one in (a, b, mine)]
    assert a["ranges"]["force_end"] == "2 to 8" and a["cost"] == "0.5 to 20" and a["solved"] == "3 of 9"
    assert a["count"] == "–" and a["cannot"] == [] and a["scenes"] == 2 and not a["ours"] and mine["ours"]
    assert a["missing"] == ["ball_clamped", "liver_probe", "kidney_probe"]
    assert b["cannot"] == ["liver_press: no <planes>"] and b["solved"] == "0 of 9" and b["scenes"] == 1
    free, lost, rounded = (
        cards([row("one", "liver_press", *numbers) | more])[0]
        for numbers, more in (
            ((1.0, 0.5, NAN), {}),
            ((NAN, NAN, NAN), {"status": "skipped", "message": "lost: no", **LOST}),
            ((1.0, 0.5, 1.0), {"penetration [%]": 2.7e-9}),
        )
    )
    assert free["solved"] == "2 of 9" and free["cost"] == "–" and rounded["ranges"]["penetration"] == "0"
    assert lost["solved"] == "–", "nothing was judged: that is no failure in nine pairs"


def test_the_page_shows_every_row_and_every_hash_of_what_is_held_back():
    text = page(ROWS, SVG).decode()
    assert text.count('<th scope="row">') == len(ROWS) and text.count("<li><h3>") == 3
    assert "no &lt;planes&gt;" in text and "+2.9\u00a0±\u00a00.5" in text and SET in text
    for name, one in frozen().items():
        assert (one.physics in text) == one.held_back and name in text
        assert not one.held_back or (one.reference or "reference not solved yet") in text
    assert "://" not in re.sub(r"http://www.w3.org/\S+", "", text) and "<script" not in text


def test_the_report_has_a_section_for_it(tmp_path):
    studies = made_up_parts(tmp_path)
    plain, _ = write_page(tmp_path, studies)
    assert plain is not None and 'id="league"' not in plain.read_text(encoding="utf-8")
    path, _ = write_page(tmp_path, studies, cards(ROWS))
    assert path is not None
    section = path.read_text(encoding="utf-8").split('<section id="league"')[1].split("</section>")[0]
    assert section.count('<th scope="row">') == 3 and 'href="league.html"' in section and "0.5 to 20" in section


def test_the_chart_has_a_line_for_each_engine_with_a_pair():
    sheet = figure(profiles(ROWS))
    first = sheet.axes[0]
    assert first.get_title().startswith("force within 3 %")
    steps = [line for line in first.get_lines() if len(line.get_xdata()) > 1 and line.get_drawstyle() == "steps-post"]
    assert [tuple(np.round(line.get_ydata(), 9)) for line in steps] == [
        pytest.approx((0.0, 1 / 9, 2 / 9, 3 / 9)),
        pytest.approx((0.0, 1 / 9)),
    ]
