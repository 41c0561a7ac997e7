"""Two meshes of one scene that agree are trusted; two that differ are not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studies.catalog.of_scene import study_of
from studies.cli.commands.run import _say_trust
from studies.metrics.trust import Apart, allowed_share, apart, verdicts, within
from studies.metrics.wish import Wish
from studies.runs.case import BodyRecipe
from studies.scene.library.liver_probe import LIVER_PROBE
from studies.scene.library.spleen_sag import SPLEEN_SAG
from studies.store.record import Status
from tests.studies import made_up_run
from tests.studies.tiny import tiny_study

FINE = BodyRecipe("quadratic", 1194, graded="adaptive")
COARSE, FINEST = replace(FINE, nodes=994), replace(FINE, nodes=1594)
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
    assert apart(body_run(COARSE), body_run(FINE)) == pytest.approx(Apart(0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("share", [0.5, 1.0])
@pytest.mark.parametrize(
    ("force", "displacement", "trusted"),
    [(2.9, 0.9, True), (3.1, 0.9, False), (2.9, 1.1, False), (np.nan, 0.9, True), (np.nan, np.nan, False)],
)
def test_both_must_be_within_a_share_of_the_wish(share, force, displacement, trusted):
    assert within(Apart(share * force, share * displacement), WISH, share) == trusted


def test_meshes_that_show_nothing_are_not_within_it():
    assert not within(Apart(0.0, 0.0), WISH, 0.0)


def test_a_verdict_names_both_meshes_and_both_numbers():
    (verdict,) = verdicts([body_run(FINE), body_run(COARSE, force=1.02, shift=0.9), body_run(BodyRecipe("surface"))])
    assert not verdict.trusted and verdict.scene == "ball_clamped"
    assert verdict.why == "two meshes (994 and 1,194 nodes) differ by 2 % in force and 10 % in displacement"


def hanging(runs):
    return [replace(one, case=replace(one.case, scene=SPLEEN_SAG)) for one in runs]


@pytest.mark.parametrize("shift", [1.0, 0.9999, 0.9])
def test_coarse_meshes_of_an_organ_that_hangs_are_not_trusted_even_where_they_agree(shift):
    (verdict,) = verdicts(hanging([body_run(FINE), body_run(COARSE, shift=shift)]))
    assert not verdict.trusted and verdict.why.startswith("what hangs needs 1,594 nodes")


@pytest.mark.parametrize(("shift", "trusted"), [(0.996, True), (0.993, False)])
def test_of_an_organ_that_hangs_half_of_the_target_is_allowed(shift, trusted):
    (verdict,) = verdicts(hanging([body_run(FINEST), body_run(FINE, shift=shift)]))
    assert verdict.trusted == trusted and verdict.why.endswith("; allowed: 0.5 times the target")


@pytest.mark.parametrize(
    ("fine", "shift", "trusted"),
    [(FINE, 0.991, True), (FINE, 0.989, False), (FINEST, 0.986, True), (FINEST, 0.984, False)],
)
def test_meshes_may_differ_by_more_where_the_finer_has_enough_nodes(fine, shift, trusted):
    (verdict,) = verdicts([body_run(fine), body_run(COARSE, shift=shift)])
    assert verdict.trusted == trusted


def test_the_study_of_a_scene_that_hangs_takes_the_nodes_that_its_warning_needs():
    bodies = [case.body for case in study_of(SPLEEN_SAG).cases if case.body.graded == "adaptive"]
    assert [body.nodes for body in bodies] == [1194, 1594] and allowed_share(SPLEEN_SAG, bodies[-1].nodes) > 0.0
    others = [case.body.nodes for case in study_of(LIVER_PROBE).cases if case.body.graded == "adaptive"]
    assert others == [994, 1194]


def test_where_there_is_a_reference_it_judges():
    known = [replace(one, reference=made_up_run.reference()) for one in (body_run(FINE), body_run(COARSE))]
    assert verdicts(known) == []


def test_one_mesh_is_no_verdict_and_a_failed_run_none():
    assert verdicts([body_run(FINE)]) == []
    assert verdicts([body_run(FINE), body_run(COARSE, status=Status.INVERTED)]) == []
    assert verdicts([body_run(FINE), body_run(replace(COARSE, graded=True))]) == []


@pytest.mark.parametrize(("shift", "answer"), [(0.9999, "yes"), (0.9, "no: use more nodes")])
def test_a_run_of_a_scene_ends_with_the_verdict(monkeypatch, capsys, shift, answer):
    runs = [body_run(COARSE, shift=shift), body_run(FINE)]
    monkeypatch.setattr("studies.sweep.load.load_runs", lambda root, study: (runs, []))
    _say_trust(Path(), tiny_study())
    assert f"ball_clamped: trust its best body: {answer}, because two meshes" in capsys.readouterr().out
