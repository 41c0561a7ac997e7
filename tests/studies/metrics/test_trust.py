"""Two meshes of one scene that agree are trusted; two that differ are not."""

from dataclasses import replace

import numpy as np
import pytest

from studies.catalog.of_scene import study_of
from studies.geometry import HalfSpace
from studies.metrics.trust import FEW_FACETS, Apart, apart, doubt, verdicts, within
from studies.metrics.wish import Wish
from studies.runs.recipes import QuadraticBody
from studies.scene.cut import Cut
from studies.scene.library.liver_probe import LIVER_PROBE
from studies.scene.library.spleen_sag import SPLEEN_SAG
from studies.store.record import Status
from tests.studies import made_up_run

FINE = QuadraticBody(1594, graded="adaptive")
COARSE = replace(FINE, nodes=1194)
BALL = made_up_run.SCENE
WISH = Wish(3.0, 1.0)


def body_run(body, *, force=1.0, shift=1.0, status=Status.OK):
    """The cube, its force scaled and its displacement a shift."""
    moved = made_up_run.POINTS + shift * made_up_run.SHIFT
    values = {"snapshots": np.stack([made_up_run.POINTS, moved])}
    made = made_up_run.run(force=force * np.array([0.5, 1.0, 1.5, 2.0]), values=values, status=status, reference=None)
    made = replace(made, case=replace(made.case, body=body))
    return made


@pytest.fixture(autouse=True)
def flat_facets(monkeypatch):
    monkeypatch.setattr("studies.metrics.run.six_node_facets", lambda triangles: triangles)


def test_how_far_two_bodies_are_apart():
    between = apart(body_run(COARSE, force=1.02, shift=0.9), body_run(FINE))
    assert between == pytest.approx(Apart(2.0, 10.0), rel=1e-9)
    at_the_end_alone = np.array([9.0, 9.0, 9.0, 1.02])
    assert apart(body_run(COARSE, force=at_the_end_alone), body_run(FINE)).force == pytest.approx(2.0, rel=1e-9)
    assert apart(body_run(COARSE), body_run(FINE)) == pytest.approx(Apart(0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize(
    ("force", "displacement", "trusted"),
    [(2.9, 0.9, True), (3.1, 0.9, False), (2.9, 1.1, False), (np.nan, 0.9, True), (np.nan, np.nan, False)],
)
def test_both_must_be_within_a_share_of_the_wish(force, displacement, trusted):
    assert within(Apart(0.5 * force, 0.5 * displacement), WISH, 0.5) == trusted


@pytest.mark.parametrize(
    ("scene", "shift", "trusted"),
    [(BALL, 0.986, True), (BALL, 0.984, False), (SPLEEN_SAG, 0.996, True), (SPLEEN_SAG, 0.993, False)],
)
def test_meshes_of_an_organ_that_hangs_may_differ_by_less(scene, shift, trusted):
    runs = [body_run(FINE), body_run(COARSE, shift=shift)]
    (verdict,) = verdicts([replace(one, case=replace(one.case, scene=scene)) for one in runs])
    assert verdict.trusted == trusted


CUT = replace(BALL, cuts=(Cut("section", HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), at=0.1),))


@pytest.mark.parametrize(
    ("scene", "coarse", "changes", "why"),
    [
        (BALL, COARSE, {}, ""),
        (BALL, replace(COARSE, nodes=894), {"nodes": 1194}, "meshes with fewer than 1,594 nodes"),
        (BALL, replace(FINE, nodes=1494), {}, "meshes with nearly as many nodes"),
        (BALL, replace(COARSE, graded=True), {"graded": True}, "the rule is measured for adaptive bodies"),
        (CUT, COARSE, {}, "the rule is not measured for scenes with cuts"),
    ],
)
def test_what_was_not_measured_is_not_trusted_even_where_two_meshes_agree(scene, coarse, changes, why):
    runs = [body_run(coarse), body_run(replace(FINE, **changes))]
    (verdict,) = verdicts([replace(one, case=replace(one.case, scene=scene)) for one in runs])
    assert verdict.trusted == (not why) and verdict.why.startswith(why or "two meshes")


@pytest.mark.parametrize("scene", [LIVER_PROBE, SPLEEN_SAG])
def test_the_study_of_a_scene_takes_the_nodes_that_its_warning_needs(scene):
    bodies = [case for case in study_of(scene).cases if case.body.graded == "adaptive"]
    assert [case.body.nodes for case in bodies] == [1194, 1594] and not doubt(*bodies)


def test_a_body_that_warns_of_few_facets_is_not_trusted_however_near_two_meshes_are():
    def warned(made):
        attributes = {**made.record.attributes, "warnings": FEW_FACETS}
        return replace(made, record=replace(made.record, attributes=attributes))

    (doubted,) = verdicts([body_run(COARSE), warned(body_run(FINE))])
    assert not doubted.trusted and doubted.why.startswith("too few facets touch the probe; two meshes")
    assert verdicts([warned(body_run(COARSE)), body_run(FINE)])[0].trusted, "the coarser one is not in question"


def test_where_there_is_a_reference_it_judges():
    runs = [replace(one, reference=made_up_run.reference()) for one in (body_run(FINE), body_run(COARSE))]
    assert verdicts(runs) == []


def test_one_mesh_is_no_verdict_and_a_failed_run_none():
    assert verdicts([body_run(FINE)]) == []
    assert verdicts([body_run(FINE), body_run(COARSE, status=Status.INVERTED)]) == []
    assert verdicts([body_run(FINE), body_run(replace(COARSE, graded=True))]) == []
