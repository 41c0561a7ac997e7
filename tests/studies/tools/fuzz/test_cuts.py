"""Trials of cuts: each end has its name, and a cut that changes the body does not pass."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from studies.runs.prepare import prepared_on
from studies.tools.fuzz import cuts as module
from studies.tools.fuzz.cuts import (
    CHOICES,
    CutTrial,
    case_of,
    draw,
    mesh_of,
    overlap,
    parted_early,
    parts_differ,
    scene_of,
    tried,
)
from studies.tools.fuzz.outcome import UNEXPLAINED

CALM = CutTrial(seed=0, number=0, nodes=80)


def test_a_trial_is_its_seed_and_number():
    assert draw(3, 7) == draw(3, 7) != draw(3, 8) and draw(4, 7) != draw(3, 7)
    assert "fuzz --cuts --seed 3 --trial 7" in draw(3, 7).line


def test_everything_is_drawn():
    trials = [draw(1, number) for number in range(600)]
    for name, values in CHOICES.items():
        assert {getattr(trial, name) for trial in trials} >= set(values)
    assert {trial.organ for trial in trials} > {"stomach"} and len({trial.method for trial in trials}) > 5
    assert min(trial.height for trial in trials) < 0 and max(trial.height for trial in trials) > 1
    assert min(trial.pull for trial in trials) < 0 < max(trial.pull for trial in trials)
    kinds = {trial.kind for trial in trials}
    assert kinds >= {"solid", "solid, advancing, touching", "solid, virtual nodes", "solid, paper's surface", "hollow"}


def test_a_trial_is_made_gentler_choice_by_choice():
    trials = list(replace(CALM, nodes=500, advance=0.5).gentler())
    assert [trial.changed for trial in trials] == [{"advance": 0.5}, {"nodes": 500}, {"nodes": 250, "advance": 0.5}]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"height": 1.03}, "misses the body"),
        ({"height": 0.03}, "crosses the outline|leaves a piece"),
        ({"organ": "stomach"}, "goes through the wall of a hollow organ"),
        ({"held": "one end"}, "a piece that nothing holds"),
        ({"held": "across"}, "crosses the outline of a held region"),
        ({"blade": "ball", "reach": 1.1}, "reaches the surface"),
        ({"when": 0.01}, "is not between two of the 20 frames"),
        ({"advance": 0.01}, "within one of 20 frames"),
        ({"body": "surface", "advance": 0.5}, "the surface body does not apply"),
        ({"body": "surface", "blade": "half space"}, "the surface body does not apply"),
        ({"way": "virtual", "advance": 0.5}, "whose cut advances"),
        ({"way": "virtual", "body": "quadratic"}, "has no setting 'cut'"),
        ({"way": "virtual", "contact": True}, "whose faces of the cut touch"),
        ({"opens": True}, "its organ is solid"),
    ],
)
def test_what_cannot_be_cut_is_refused_before_it_is_meshed(changes, words, monkeypatch):
    monkeypatch.setattr(module, "mesh_of", lambda trial, scene: 1 // 0)
    outcome = tried(replace(CALM, **changes))
    assert outcome.status == "refused"
    assert any(part in outcome.message for part in words.split("|")), outcome.message


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"blade": "half space", "body": "cotangent", "pull": 0.1},
        {"held": "one end", "free": True, "gravity": 9.81},
        {"body": "surface", "pull": 0.1},
        {"way": "virtual", "body": "cotangent", "pull": 0.1},
        {"blade": "half space", "body": "cotangent", "pull": 0.1, "advance": 0.5},
        {"body": "quadratic", "contact": True, "pull": -0.1},
        {"organ": "hollow ball", "blade": "half space", "opens": True, "content": "filled", "pull": 0.1},
        {"organ": "hollow ball", "blade": "half space", "opens": True, "body": "quadratic", "pull": 0.1},
    ],
)
def test_cuts_that_can_be_run(changes):
    outcome = tried(replace(CALM, **changes))
    assert (outcome.status, outcome.message) == ("ok", "")


@pytest.mark.slow
@pytest.mark.parametrize("number", range(3))
def test_random_cuts_end_by_name(number):
    outcome = tried(draw(7, number))
    assert outcome.status != UNEXPLAINED, outcome.message


def test_an_error_that_is_not_ours_and_a_mesher_that_dies_are_findings(monkeypatch):
    monkeypatch.setattr(module, "mesh_of", lambda trial, scene: 1 // 0)
    assert (tried(CALM).status, tried(CALM).message.split(":")[0]) == (UNEXPLAINED, "ZeroDivisionError")

    def dies(trial, scene):
        raise module.StudyError("ball: the mesher ended with code -11 at: filling")

    monkeypatch.setattr(module, "mesh_of", dies)
    assert tried(CALM).status == UNEXPLAINED


@pytest.mark.slow
def test_a_cut_that_changes_the_body_is_a_finding():
    scene = scene_of(CALM)
    with module._own_meshes():
        mesh = mesh_of(CALM, scene)
    prepared = prepared_on(case_of(CALM, scene), mesh)
    assert parts_differ(prepared, mesh) is None
    event = prepared.setup.events[0]
    heavier = replace(event, body=replace(event.body, mass=event.body.mass * (1 + 1e-10)))
    assert "mass changes" in str(
        parts_differ(replace(prepared, setup=replace(prepared.setup, events=(heavier,))), mesh)
    )
    assert prepared.opening is not None
    places = np.stack([prepared.body.rest, prepared.body.rest])
    places[0, prepared.opening.pairs[0, 1]] += 1e-9
    assert "before the cut" in str(parted_early(prepared, _History(places)))
    places = np.stack([prepared.body.rest, prepared.body.rest + 1e-3])
    assert parted_early(prepared, _History(places)) == "nothing opens"


@pytest.mark.slow
def test_how_deep_faces_overlap():
    trial = replace(CALM, contact=True)
    scene = scene_of(trial)
    with module._own_meshes():
        prepared = prepared_on(case_of(trial, scene), mesh_of(trial, scene))
    assert prepared.opening is not None
    for shift, deep in (((0, 0, -1e-3), 1e-3), ((0, 0, 1e-3), 0.0), ((1.0, 0, -1e-3), 0.0)):
        places = prepared.body.rest.copy()
        places[prepared.opening.pairs[:, 1]] += shift
        assert overlap(prepared, _History(places[None])) == pytest.approx(deep, abs=1e-12)


class _History:
    def __init__(self, snapshots: np.ndarray):
        self.snapshots = snapshots
        self.final = snapshots[-1]


@pytest.mark.campaign
def test_the_command_tells_and_writes(organbench, tmp_path):
    code, out, err = organbench("fuzz", "--cuts", "--cases", 2, "--seed", 11, "--jobs", 1, "--results", tmp_path)
    assert code == 0, out + err
    assert len(pd.read_csv(tmp_path / "breaking_cuts" / "trials.csv.gz")) == 2 and "all" in out
    code, out, err = organbench("fuzz", "--cuts", "--reference", "--results", tmp_path)
    assert code == 2 and "give one of them" in err
