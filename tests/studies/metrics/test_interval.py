"""A scene without a reference: two meshes bound the errors of both, or a sentence says why not."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from massspring import Projection
from studies.catalog.of_scene import study_of
from studies.geometry import HalfSpace
from studies.meshing.true_surface import ShapeErrors
from studies.metrics import interval as module
from studies.metrics.cells import UNTESTED_MARK
from studies.metrics.interval import RULE_FILE, Apart, apart, interval, second_mesh, sentences
from studies.metrics.judged import UNKNOWN, cheapest, judged
from studies.metrics.metrics import force_within
from studies.metrics.table import marked, metric, row_of
from studies.metrics.wish import Wish
from studies.report.page.best import answers, best_bodies, scene_rows
from studies.runs.current import case_path
from studies.runs.recipes import QuadraticBody
from studies.scene.cut import Cut
from studies.scene.kind import load_of
from studies.scene.library import LIVER_PROBE, SPLEEN_SAG
from studies.store.ledger import Ledger
from studies.store.record import Status, write_record
from studies.sweep.load import References, load_runs, table_rows
from studies.tools.advise.answer import Advice
from studies.tools.advise.campaign import stored_of_user
from studies.tools.advise.words import lines_of
from tests.studies import made_up_run

FINE = QuadraticBody(1594, graded="adaptive")
COARSE = replace(FINE, nodes=1194)
BALL = made_up_run.SCENE
CUT = replace(BALL, cuts=(Cut("section", HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), at=0.1),))
OTHER = {"members": 9, "floor": 0.5, "of_shape": 0.0, "factor": {"1194": 2.0, "1594": 1.0}}
HUNG = {"members": 9, "floor": 1.0, "of_shape": 0.0, "factor": {"1194": 5.0, "1594": 4.0}}
SEEN = {"force": 5.0, "displacement": 20.0, "sway": 9.0, "shape": 99.0, "facets": 0.0}
RULE = {
    "nodes": [1194, 1594],
    "force": {"other": OTHER},
    "displacement": {"other": OTHER, "weight": HUNG},
    "loads": ["sag", load_of(BALL)],
    "seen": SEEN,
}


@pytest.fixture(autouse=True)
def _rule(monkeypatch):
    monkeypatch.setattr("studies.metrics.run.six_node_facets", lambda triangles: triangles)
    monkeypatch.setattr(module, "RULE", RULE)


def body_run(body, *, force=1.0, shift=1.0, status=Status.OK, scene=BALL, **changes):
    """The cube, its force scaled and its displacement a shift."""
    moved = made_up_run.POINTS + shift * made_up_run.SHIFT
    values = {"snapshots": np.stack([made_up_run.POINTS, moved])}
    made = made_up_run.run(
        force=force * np.array([0.5, 1.0, 1.5, 2.0]), values=values, status=status, reference=None, **changes
    )
    return replace(made, case=replace(made.case, body=body, scene=scene))


def pair(fine=FINE, coarse=COARSE, *, force=1.02, shift=0.9, status=Status.OK, **both):
    """The fine run with a coarse one whose force and displacement differ."""
    return replace(body_run(fine, **both), second=body_run(coarse, force=force, shift=shift, status=status, **both))


def test_how_far_two_bodies_are_apart():
    between = apart(body_run(COARSE, force=1.02, shift=0.9), body_run(FINE))
    assert between == pytest.approx(Apart(2.0, 10.0), rel=1e-9)
    at_the_end_alone = np.array([9.0, 9.0, 9.0, 1.02])
    assert apart(body_run(COARSE, force=at_the_end_alone), body_run(FINE)).force == pytest.approx(2.0, rel=1e-9)
    assert apart(body_run(COARSE), body_run(FINE)) == pytest.approx(Apart(0.0, 0.0), abs=1e-9)


def test_each_mesh_has_its_interval_and_an_organ_that_hangs_another():
    run = pair()
    assert interval(run)[:2] == pytest.approx((1.0 * (0.5 + 2.0), 1.0 * (0.5 + 10.0)))
    assert interval(replace(run.second, second=run))[:2] == pytest.approx((2.0 * (0.5 + 2.0), 2.0 * (0.5 + 10.0)))
    hung = interval(
        pair(scene=replace(SPLEEN_SAG, gravity=(0.0, 0.0, -5.0), checkpoints=BALL.checkpoints, organ=BALL.organ))
    )
    assert math.isnan(hung.force) and hung.displacement == pytest.approx(4.0 * (1.0 + 10.0))
    one = judged(run)
    assert one.bounds and (one.force.value, one.displacement.value) == pytest.approx((2.5, 10.5))


def test_a_body_off_its_shape_has_a_wider_interval(monkeypatch):
    monkeypatch.setitem(RULE, "displacement", {"other": OTHER | {"of_shape": 2.0}})
    run = pair()
    run.__dict__["shape"] = ShapeErrors(0.0025, 0.0)
    assert interval(run)[:2] == pytest.approx((2.5, 10.5 * (1.0 + 2.0 * 0.25)))
    lost = pair()
    lost.__dict__["shape"] = ShapeErrors(math.nan, math.nan)
    assert interval(lost).why.startswith("the shape of its organ is unknown")


def test_the_sentence_has_the_force_and_the_displacement_of_the_finest_body():
    runs = [pair(), pair().second]
    assert sentences(runs) == [
        "ball_clamped: force 2 N ± 2.5 %, displacement up to 30 mm ± 10 % in the mean (90 of 100)"
    ]
    judge = made_up_run.reference()
    assert sentences([replace(one, reference=judge) for one in runs]) == [], "where there is a reference it judges"


def test_a_load_that_no_member_was_under_is_named(monkeypatch):
    monkeypatch.setitem(RULE, "loads", ["fill", "probe"])
    (sentence,) = sentences([pair()])
    words, run = "tested on none under squeeze", pair()
    assert sentence.endswith(f"(90 of 100; {words})")
    run.__dict__["shape"] = ShapeErrors(0.001, 0.0)
    assert f"90 of 100 such bodies ({words})" in answers(best_bodies([run], lambda one: "it"))["How wrong?"]
    marks = [marked(row_of(run, [metric(name)])) for name in ("force_within", "mean_error")]
    assert [UNTESTED_MARK in mark for mark in marks] == [True, False]


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"fine": replace(FINE, graded=True)}, "it takes two meshes .* of 1,194 and 1,594 nodes by implicit_volume"),
        ({"fine": replace(FINE, volumes="element")}, "it takes two meshes"),
        ({"fine": replace(FINE, nodes=1694)}, "it takes two meshes"),
        ({"coarse": replace(FINE, nodes=1494)}, "it takes two meshes"),
        ({"scene": CUT}, "scenes without cuts"),
        ({"scene": replace(BALL, gravity=(0.0, 0.0, -99.0))}, r"outside: its weight rho g L is .* up to 0.5\)"),
        ({"status": Status.FOLDED}, "the body with 1,194 nodes is folded"),
        ({"force": 1.06}, "outside: forces of the two meshes that differ by 6 %, more than any organ .* rests on .5."),
        ({"shift": 0.75}, "outside: displacements of the two meshes that differ by 25 %, more"),
        ({"attributes": {"unsettled": 0.066}}, "at the end the body is 6.6 % of its displacement from rest"),
        ({"attributes": {"unsettled": 0.002, "swing": 0.012}}, "at the end the body is 1.2 % of its displacement from"),
        ({"attributes": {"sway": 0.1}}, "outside: a force that sways by 10 %, more .* .9."),
        ({"scene": replace(BALL, quantities=("volume",))}, "no organ in which the scene's quantities are compared"),
    ],
)
def test_what_the_rule_has_not_seen_has_a_sentence_and_no_interval(changes, why):
    bounds = interval(pair(**changes))
    assert math.isnan(bounds.force) and math.isnan(bounds.displacement)
    assert re.search(why, bounds.why), bounds.why


def test_shape_and_facets_are_those_of_the_finer_body(monkeypatch):
    monkeypatch.setitem(RULE["seen"], "facets", 25.0)
    assert not interval(pair()).why, "no facets where no tool is"
    monkeypatch.setattr(module, "contact_facets", lambda run: 4.0 if run.case.body == FINE else 99.0)
    few = interval(replace(pair().second, second=pair())).why
    assert few == "outside: 4 facets under the tool, fewer than any organ that the rule rests on (25)"
    monkeypatch.setitem(RULE["seen"], "shape", 1.0)
    assert "of the size off its organ, more" in interval(pair()).why


def test_a_run_alone_or_by_another_method_has_none():
    assert "it takes two meshes" in interval(body_run(FINE)).why
    other = replace(pair(), case=replace(pair().case, method=Projection()))
    assert "it takes two meshes" in interval(other).why
    assert sentences([other])[0].endswith("by implicit_volume; a reference would tell them")


@pytest.mark.parametrize("scene", [LIVER_PROBE, SPLEEN_SAG])
def test_the_study_of_a_scene_has_the_two_meshes_of_the_rule(scene):
    cases, rule = study_of(scene).cases, json.loads(RULE_FILE.read_text(encoding="utf-8"))
    coarse, fine = (case for case in cases if case.body.graded == "adaptive")
    assert [coarse.body.nodes, fine.body.nodes] == rule["nodes"]
    assert second_mesh(fine, cases) == coarse and second_mesh(coarse, cases) == fine
    assert second_mesh(cases[0], cases) is None, "the springs alone are one mesh by another method"


def test_a_mesh_that_the_rule_knows_is_the_second_one():
    cases = [body_run(replace(FINE, nodes=nodes)).case for nodes in (994, 1194, 1394)]
    assert second_mesh(body_run(FINE).case, cases) == cases[1]


@pytest.fixture
def results(tmp_path):
    """Both meshes of the ball, stored below a results folder by the study of its scene."""
    scene = replace(BALL, name="mine", reference=None)
    study = study_of(scene)
    for case in study.cases[-2:]:
        run = body_run(case.body, force=1.02 if case.body == study.cases[-2].body else 1.0, shift=1.0)
        path = case_path(tmp_path, study.name, case)
        path.parent.mkdir(exist_ok=True)
        write_record(path, replace(run.record, name=case.name, key=case.key))
    return tmp_path, study


def test_stored_runs_without_a_reference_find_their_second_mesh(results):
    root, study = results
    runs, _ = load_runs(root, study)
    rows, _ = table_rows(References(Ledger(root)), study, [metric("force_within"), metric("mean_within")])
    for run, row, factor in zip(runs, rows, (2.0, 1.0), strict=True):
        assert run.second is not None and run.second.case.body.nodes == 2788 - run.case.body.nodes
        assert row["force_within [%]"] == pytest.approx(factor * (0.5 + 2.0)) == force_within(run)
        assert row["mean_within [%]"] == pytest.approx(factor * 0.5)


@pytest.mark.parametrize(("force", "nodes"), [(6.0, 1194), (3.0, 1594), (2.0, None)])
def test_the_cheapest_body_whose_interval_fits_is_advised(results, force, nodes):
    root, study = results
    stored = stored_of_user(root, study.scenes[0])
    assert stored is not None
    rows = [replace(row, shape=UNKNOWN, shape_volume=UNKNOWN) for row in stored.cases["mine"]]  # a cube is no ball
    one = cheapest(rows, Wish(force=force))
    assert nodes == (None if one is None else one.case.body.nodes)
    if one is not None:
        answer = Advice(study.scenes[0], Wish(force=force), False, stored, one, True, (), ())
        assert f"{one.force.value:.2g} %, which 90 of 100 such bodies stay within" in " ".join(lines_of(answer))


def test_the_page_says_that_bounds_are_none_of_a_reference():
    run = pair()
    run.__dict__["shape"] = ShapeErrors(0.001, 0.0)
    (best,) = best_bodies([run], lambda one: "it")
    assert not best["meets"]
    assert "Force off by 2.5 % at most in 90 of 100 such bodies" in answers([best])["How wrong?"]
    ((cells, *_),) = (row["rows"] for row in scene_rows([best]))
    assert cells["numbers"][:2] == ["≤ 2.5", "≤ 10.5"]
