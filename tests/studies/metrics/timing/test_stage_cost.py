"""The cost of a step adds up, names what was left out, and what was left out changes no answer."""

import re

import numpy as np
import pytest

from massspring import Free, ImplicitVolume
from studies.metrics.timing.skips import SKIPS
from studies.metrics.timing.stage_cost import FRAME, ROWS, SKIPPED, STAGE, cost_table, run_frames
from studies.runs.prepare import prepare
from studies.runs.recipes import QuadraticBody, SurfaceBody, TetrahedralBody
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.library.liver_incised import LIVER_INCISED
from studies.scene.library.stomach_slide import STOMACH_SLIDE
from tests.studies.tiny import tiny_case

HELD = TetrahedralBody(nodes=100)
"""Fewer do not keep the area where the ball is held."""
NO_CONTACT = "contact of nodes: no plane, sphere or capsule"


@pytest.fixture(scope="module")
def squeezed(mesh_cache):
    return cost_table(tiny_case(), repeats=2)


def test_a_turn_begins_only_when_there_is_time_for_it(squeezed):
    assert squeezed.attrs["turns"] == 2
    assert cost_table(tiny_case(), repeats=5, budget=0.0).attrs["turns"] == 1


def cost_of(table, what) -> float:
    return float(table.set_index("what")["µs per step"][what])


def test_stages_and_rest_are_the_whole_step(squeezed):
    parts = squeezed[(squeezed["kind"] == STAGE) & (squeezed["what"] != "whole step")]
    whole = cost_of(squeezed, "whole step")
    assert parts["µs per step"].sum() == pytest.approx(whole, rel=1e-12)
    assert parts["share of the step"].sum() == pytest.approx(1.0, rel=1e-12)
    assert set(parts["what"]) <= {*ROWS, "rest, not attributed"}
    assert cost_of(squeezed, "springs and prediction") > 0 and cost_of(squeezed, "contact search") > 0


def test_what_is_left_out_is_named(squeezed):
    left_out = squeezed[squeezed["kind"] == SKIPPED]["what"].tolist()
    missing = ["thin probe: none", "gravity: none in this scene"]
    one = "linear solve: one volume is a division"
    assert left_out == [*missing, "friction: no obstacle has any", one]
    bare = cost_table(tiny_case(scene=BALL_CLAMPED, body=HELD, method=Free()), repeats=1)
    assert bare[bare["kind"] == SKIPPED]["what"].tolist() == [NO_CONTACT, *missing]
    assert "contact search" not in set(bare["what"])
    assert len(squeezed[squeezed["kind"] == FRAME]) == 2


def test_a_run_that_is_timed_is_cut_where_its_scene_is():
    prepared = prepare(tiny_case(scene=LIVER_INCISED, body=TetrahedralBody(250), frames=20))
    setup = prepared.setup
    assert len(run_frames(setup, setup.start())[2].x) == prepared.body.node_count > setup.body.node_count


LEFT_OUT = [
    pytest.param(
        skip,
        method,
        id=f"{method.name}-{skip.name.split(':')[0]}",
        marks=pytest.mark.campaign if skip.name.startswith("pairs") else (),  # the mesh of a stomach
    )
    for skip in SKIPS
    for method in (Free(), ImplicitVolume())
    if method.capabilities.keeps != "none" or not skip.name.startswith("linear solve")
]


@pytest.mark.parametrize(("skip", "method"), LEFT_OUT)
def test_leaving_a_stage_out_changes_no_answer(skip, method):
    """Bit for bit; the small solve in place of the division adds in another order, and differs by round-off."""
    case = tiny_case(method=method)
    if skip.name.startswith("contact"):
        case = case.replaced(scene=BALL_CLAMPED, body=HELD)
    if skip.name.startswith("pairs"):
        case = case.replaced(scene=STOMACH_SLIDE, body=SurfaceBody(300))
    setup = prepare(case).setup
    assert skip.left_out(setup)
    without = run_frames(setup, setup.start())[2]
    with_stage = run_frames(*skip.included(setup, setup.start()))[2]
    if skip.name.startswith("linear solve"):
        assert np.abs(without.x - with_stage.x).max() < 1e-6 * setup.body.size
    else:
        assert np.array_equal(without.x, with_stage.x) and np.array_equal(without.v, with_stage.v)


def test_a_quadratic_body_leaves_out_what_it_could_have(mesh_cache):
    """A thin probe next to it is refused, so none is left out."""
    table = cost_table(tiny_case(body=QuadraticBody(234)), frames=1, repeats=1)
    assert {"gravity: none in this scene", "friction: no obstacle has any"} < set(table["what"])
    assert "thin probe: none" not in set(table["what"])


@pytest.mark.campaign
def test_the_table_counts_the_pairs_that_sleep(mesh_cache):
    """Of the thin probe on the stomach nearly all pairs sleep, and the line says what was still compared."""
    table = cost_table(tiny_case(scene=STOMACH_SLIDE, body=SurfaceBody(300)), repeats=1)
    assert "thin probe: none" not in set(table["what"])
    (line,) = (text for text in table["how much"] if text)
    pairs, boxes = re.search(r"of ([0-9,]+) pairs a step ([0-9.e+]+) boxes compared", line).groups()
    assert 0 < float(boxes) < 0.5 * int(pairs.replace(",", ""))
    assert line.endswith("left behind 0")
