"""Trials of the reference: each end has its name, and what converged is measured apart from the solver."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pandas as pd
import pytest

from reference_fem import equilibrium_path
from reference_fem.system.saddle_point import System
from studies.tools.fuzz.campaign import table_of
from studies.tools.fuzz.outcome import UNEXPLAINED, simplest
from studies.tools.fuzz.reference import outcome as module
from studies.tools.fuzz.reference.outcome import Reached, tried
from studies.tools.fuzz.reference.surroundings import task_of
from studies.tools.fuzz.reference.table import counts_by_choice, last_states
from studies.tools.fuzz.reference.trial import CHOICES, FLAWS, ReferenceTrial, draw
from studies.tools.fuzz.reference.truths import at_rest, broken, corner_ratio

CALM = ReferenceTrial(seed=0, number=0, nodes=7)
PRESSED = replace(CALM, load="plane", depth=0.1, gravity=9.81, steps=2)


def test_a_trial_is_its_seed_and_number():
    assert draw(3, 7) == draw(3, 7) != draw(3, 8) and draw(4, 7) != draw(3, 7)
    assert "--reference --seed 3 --trial 7" in draw(3, 7).line


def test_everything_is_drawn():
    trials = [draw(1, number) for number in range(1500)]
    for name, values in CHOICES.items():
        assert {getattr(trial, name) for trial in trials} >= set(values)
    assert {trial.flaw for trial in trials} == {"none", *FLAWS} and {"liver", "fill", "pump"} <= {
        value for trial in trials for value in (trial.shape, trial.load)
    }
    assert max(trial.bulk for trial in trials) > 5e5 and max(trial.mu / 2.0 for trial in trials) > 5e5
    assert max(trial.depth for trial in trials) > 0.85 and sum(trial.speed > 0.0 for trial in trials) > 100


@pytest.mark.parametrize(
    ("changes", "status", "words"),
    [
        ({}, "ok", ""),
        ({"load": "sphere", "slip": "no_slip", "element": "MINI"}, "ok", ""),
        ({"shape": "shell", "load": "fill", "depth": 0.2, "nodes": 9}, "ok", ""),
        ({"speed": 0.5, "gravity": 9.81, "steps": 2}, "ok", ""),
        ({"speed": 0.5, "element": "P1"}, "refused", "a motion with the element"),
        ({"flaw": "inside_out", "nodes": 8}, "refused", "mend the mesh"),
        ({"flaw": "flat", "nodes": 8}, "refused", "flat"),
        ({"flaw": "unused"}, "refused", "no tetrahedron"),
        ({"flaw": "not_finite"}, "refused", "finite"),
        ({"flaw": "loose"}, "refused", "free to"),
        ({"load": "press", "depth": 0.9, "iterations": 5, "smallest_step": 1.0}, "not-converged", "no equilibrium"),
        ({"shape": "two", "nodes": 12, "gravity": 9.81}, "not-converged", "hold it"),
    ],
)
def test_each_end_has_its_name(changes, status, words):
    outcome = tried(replace(CALM, **changes))
    assert (outcome.status, words in outcome.message) == (status, True), outcome.message


def test_time_is_processor_time_and_has_an_end():
    outcome = tried(PRESSED, seconds=0.0)
    assert (outcome.status, outcome.message) == ("timed-out", "0 of 2 requested times reached")


def test_an_error_that_is_not_ours_is_the_finding(monkeypatch):
    monkeypatch.setattr(module, "task_of", lambda trial, ask: 1 // 0)
    outcome = tried(CALM)
    assert outcome.status == UNEXPLAINED and outcome.message.startswith("ZeroDivisionError")


def test_an_error_without_the_states_that_converged_is_unexplained(monkeypatch):
    """The mutant: a failure that forgets what was reached."""
    stuck = replace(CALM, load="press", depth=0.9, steps=30, iterations=5, smallest_step=1.0, element="P1")
    outcome = tried(stuck)
    assert outcome.status == "not-converged" and 0 < outcome.reached.count < 30
    solve = module._solve

    def forgets(task, reached):
        try:
            solve(task, reached)
        except module.SolveError as error:
            raise module.SolveError(str(error)) from error

    monkeypatch.setattr(module, "_solve", forgets)
    assert "reports 0 states" in tried(stuck).message


@pytest.fixture(scope="module")
def pressed():
    """A system, and a state of rest below a plane."""
    task, reached = task_of(PRESSED), Reached()
    equilibrium_path(task.problem, task.times, task.newton, on_checkpoint=reached.checkpoint)
    return System(task.problem, task.newton), reached.equilibrium, reached.state


def test_a_state_of_rest_meets_every_truth(pressed):
    system, equilibrium, state = pressed
    assert broken(system, equilibrium, state) is None and np.abs(equilibrium.obstacle_force).max() > 0.0
    assert min(corner_ratio(system, equilibrium.u)) > 0.0


def test_each_truth_is_missed_by_what_breaks_it(pressed):
    """Mutants of a state: the sentence that each gets, and the unknowns behind it."""
    system, equilibrium, state = pressed

    def hears(words, **changes):
        assert words in str(broken(system, replace(equilibrium, **changes), state))

    hears("not finite", u=equilibrium.u * np.nan)
    hears("least volume ratio", J=equilibrium.J * 0.0)
    hears("energies", energy=-1.0)
    hears("volume of the surface", volume=equilibrium.volume * (1.0 + 1e-7))
    hears("out of balance", obstacle_force=equilibrium.obstacle_force * 1.01)
    count = system.displacement_count
    for first, last, size, words in ((0, count, 1e-6, "nodes without contact"), (count, None, 1.0, "mean pressure")):
        x = state.x.copy()
        x[first:last] += (
            size
            * (system.problem.material.mu if first else np.ptp(system.nodes))
            * np.arange(len(x))[first:last]
            / len(x)
        )
        assert words in " ".join(sentences(system, equilibrium, replace(state, x=x)))
    assert "inside an obstacle" in " ".join(sentences(system, equilibrium, replace(state, x=0.5 * state.x)))


def sentences(system, equilibrium, state):
    """Of every truth that is missed."""
    return [sentence for wrong, sentence in at_rest(system, equilibrium, state) if wrong]


def test_corners_turned_inside_out_are_seen(pressed):
    system, equilibrium, _ = pressed
    u = equilibrium.u.copy()
    u[system.problem.mesh.t[0, 0]] += 10.0 * np.ptp(system.nodes)
    assert corner_ratio(system, u)[0] < 0.0 < corner_ratio(system, u)[1]


def test_a_failure_is_reduced_to_the_choices_that_matter():
    noisy = replace(CALM, flaw="unused", law="mooney_rivlin", bulk=3e4, steps=4, load="plane", gravity=9.81)
    assert set(simplest(tried(noisy), attempt=tried).trial.changed) <= {"flaw", "nodes"}


def test_counts_and_last_states_are_stored():
    stuck = replace(CALM, load="press", depth=0.9, steps=30, iterations=5, smallest_step=1.0, element="P1", number=5)
    outcomes = [tried(CALM), tried(stuck)]
    table = counts_by_choice(table_of(outcomes))
    assert table.set_index("choice").loc["all", ["ok", "not-converged", "all"]].tolist() == [1, 1, 2]
    assert set(table[table["choice"] == "element"]["value"]) == {"P1", "P2/P1"}
    with np.load(BytesIO(last_states(outcomes))) as stored:
        assert {name.split("/")[0] for name in stored} == {"5"}
        equilibrium = outcomes[1].reached.equilibrium
        assert equilibrium is not None
        np.testing.assert_array_equal(stored["5/u"], equilibrium.u)


@pytest.mark.slow
def test_the_command_tells_and_writes(organbench, tmp_path):
    code, out, err = organbench("fuzz", "--reference", "--cases", 3, "--seed", 1, "--jobs", 1, "--results", tmp_path)
    assert code == 0, out + err
    assert len(pd.read_csv(tmp_path / "breaking_reference" / "trials.csv.gz")) == 3
    assert (tmp_path / "breaking_reference" / "last.npz").is_file() and "element" in out
