"""Trials of the stress campaign: drawn alike everywhere, ended by name; a process that dies costs its trial alone."""

import os
from dataclasses import replace

import numpy as np
import pytest

from massspring import Free, MassSpringError, simulate
from massspring.methods.implicit_volume import ImplicitVolume
from studies.geometry.mesh.organ_mesh import tetrahedron_volumes
from studies.tools.fuzz import outcome as module
from studies.tools.fuzz.outcome import UNEXPLAINED, broken, counts, depths, named, run_trials, table_of, tried
from studies.tools.fuzz.trial import CHOICES, Trial, draw
from studies.tools.fuzz.world import body_of, mesh_of, setup_of

CALM = Trial(seed=0, number=0, method="implicit_volume")


def test_a_trial_is_its_seed_and_number():
    assert draw(3, 7) == draw(3, 7) != draw(3, 8) and draw(4, 7) != draw(3, 7)
    assert "--seed 3 --trial 7" in draw(3, 7).line


def test_everything_is_drawn():
    trials = [draw(1, number) for number in range(1500)]
    for name, values in CHOICES.items():
        assert {getattr(trial, name) for trial in trials} == set(values)
    assert max(trial.heaviest for trial in trials) > 1e5
    assert max(trial.speed for trial in trials) > 9 and max(trial.depth for trial in trials) > 0.85


@pytest.mark.parametrize("shape", ["cloud", "needle", "sheet", "sliver", "two", "cell"])
def test_bodies_are_upright_and_as_odd_as_they_are_called(shape):
    points, cells = mesh_of(replace(CALM, shape=shape, nodes=60))
    assert (tetrahedron_volumes(points, cells) > 0).all() and set(cells.ravel()) == set(range(len(points)))
    extent = np.ptp(points, axis=0)
    if shape == "needle":
        assert extent[0] > 10 * extent[2]
    if shape == "sheet":
        assert extent[2] < 0.1 * extent[0]


def test_masses_and_the_origin_are_those_of_the_trial():
    plain, odd = body_of(CALM), body_of(replace(CALM, heaviest=1e6, far=10.0))
    ratio = odd.mass / plain.mass
    assert ratio.max() / ratio.min() > 1e3
    np.testing.assert_allclose(np.linalg.norm((odd.rest - plain.rest).mean(axis=0)), 10.0)


@pytest.mark.parametrize(
    ("changes", "status"),
    [
        ({}, "ok"),
        ({"dt_fraction": 3.5, "load": "plane", "steps": 600}, "diverged"),
        ({"method": "shake", "precision": "float32"}, "refused"),
        ({"start": "mirrored", "volumes": "nodal", "law": "cotangent", "nodes": 60}, "inverted"),
        ({"held": True, "precision": "float32"}, "ok"),
        ({"steps": 12 * 10**12}, "refused"),
    ],
)
def test_each_end_has_its_name(changes, status, monkeypatch):
    monkeypatch.setattr(module, "SECONDS", 600.0)  # compiling counts, on a busy machine
    outcome = tried(replace(CALM, **changes))
    assert outcome.status == status
    assert bool(outcome.message) == (status != "ok")


def test_an_error_that_is_not_ours_is_the_finding(monkeypatch):
    def fails(trial):
        raise ZeroDivisionError("in the middle")

    monkeypatch.setattr(module, "setup_of", fails)
    outcome = tried(CALM)
    assert (outcome.status, outcome.message) == (UNEXPLAINED, "ZeroDivisionError: in the middle")


@pytest.fixture(scope="module")
def pressed():
    setup = setup_of(replace(CALM, load="plane", held=True, nodes=40, depth=0.3, speed=10.0, steps=240))
    return setup, simulate(setup)


def test_a_good_run_meets_every_truth(pressed):
    setup, history = pressed
    assert broken(setup, history) == ""
    assert named(setup, replace(history, min_j=np.abs(history.min_j))) == ("ok", "")
    assert np.linalg.norm(history.contact_force).max() > 0, "the plane pressed"


def test_each_truth_is_missed_by_what_breaks_it(pressed):
    """Mutants of a history: what is recorded, and where the nodes are."""
    setup, history = pressed
    assert "not finite" in str(broken(setup, replace(history, pressure=history.pressure * np.nan)))
    assert "encloses" in str(broken(setup, replace(history, volume=history.volume * (1 + 1e-6))))
    shifted = replace(history, final=history.final + np.array([1e-6, 0.0, 0.0]))
    assert "from its prescribed position" in str(broken(setup, shifted))
    deep = replace(history, penetration=history.penetration + 0.5 * setup.body.size)
    assert "inside obstacle 0" in str(broken(setup, deep))
    upright = {"min_j": np.abs(history.min_j)}
    assert named(setup, replace(deep, **upright))[0] == "penetrated"
    assert named(setup, replace(history, inside=~history.inside))[0] == "tunnelled"
    assert named(setup, replace(history, volume=1.1 * history.volume, **upright))[0] == "drifted"
    folded = np.append(0.05, upright["min_j"][1:])
    assert named(setup, replace(history, min_j=folded))[0] == "folded"
    assert named(replace(setup, positions=setup.body.rest), replace(history, min_j=folded))[0] == "ok"
    assert named(setup, replace(history, min_j=history.min_j * 0.0))[0] == "inverted"


def test_a_curved_facet_is_no_deeper_than_its_control_points():
    """A facet that bulges towards a plane between nodes that are outside: its deepest point, of many, is between."""
    gap = np.array([0.01, 0.012, 0.02, 0.001, 0.002, 0.0])
    b = np.random.default_rng(3).dirichlet(np.ones(3), 10_000)
    sides = [4.0 * b[:, i] * b[:, j] for i, j in ((0, 1), (1, 2), (2, 0))]
    deepest = -float((np.column_stack([b * (2.0 * b - 1.0), *sides]) @ gap).min())
    nodes, facet = np.arange(6), np.arange(6)[None]
    least, most = depths(gap, nodes, facet)
    assert least == 0.0 < 0.003 < deepest < most == pytest.approx(0.015)
    assert depths(gap, nodes, facet[:0]) == (0.0, 0.0)


def test_a_method_that_forgets_the_volume_drifts_or_inverts(monkeypatch):
    """The mutant: implicit_volume that runs as free."""
    monkeypatch.setattr(ImplicitVolume, "advance", lambda self, state, boundary: Free().advance(state, boundary))
    outcome = tried(replace(CALM, load="pinch", depth=0.6, speed=10.0, nodes=40, steps=600, damping=0.3))
    assert outcome.status in ("drifted", "inverted")


def test_errors_of_bodies_are_sentences():
    with pytest.raises(MassSpringError, match="regions asked of 1 tetrahedra"):
        body_of(replace(CALM, shape="cell", volumes="regions"))


def test_elements_refuse_a_body_whose_only_volume_is_the_whole():
    """A single tetrahedron: its one patch is its surface, which no sums over elements keep."""
    outcome = tried(draw(7, 156))
    assert outcome.status == "refused" and "keep one volume per node" in outcome.message


def dies_at_two(trial):
    if trial.number == 2:
        os._exit(3)
    return tried(trial)


def test_a_trial_that_ends_its_process_is_unexplained_and_the_others_go_on(monkeypatch):
    monkeypatch.setattr(module, "tried", dies_at_two)
    heard = []
    outcomes = run_trials([replace(CALM, number=number) for number in range(4)], 2, heard.append)
    assert [outcome.status for outcome in outcomes] == ["ok", "ok", UNEXPLAINED, "ok"] and len(heard) == 4
    assert "exit code 3" in outcomes[2].message
    table = counts(table_of(outcomes))
    assert table.loc["all", ["ok", UNEXPLAINED, "all"]].tolist() == [3, 1, 4]


@pytest.mark.slow
def test_the_command_tells_and_writes(organbench, tmp_path):
    code, out, err = organbench("fuzz", "--cases", 3, "--seed", 1, "--jobs", 1, "--results", tmp_path)
    assert code == 0 and "all" in out, out + err
    assert {path.name for path in (tmp_path / "breaking").iterdir()} == {"breaking.png", "counts.csv", "trials.csv.gz"}
    code, out, _ = organbench("fuzz", "--seed", 1, "--trial", 2)
    assert code == 0 and "--seed 1 --trial 2" in out
