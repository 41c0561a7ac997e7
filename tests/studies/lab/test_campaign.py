"""The campaign: a member is the same whatever was drawn before, what a user is told is counted as that, and what was
interrupted continues."""

import os
import signal
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from studies import StudyError
from studies.lab.campaign import __main__ as command
from studies.lab.campaign import outcome
from studies.lab.campaign.draw import BEHIND, CLEAR, END, FILLED, LOADS, MOST, PRESS, PULL, member
from studies.lab.campaign.outcome import Outcome
from studies.lab.population.ranges import SQUEEZE
from studies.metrics.load_size import LARGEST
from studies.runs.indicators import remarks
from studies.scene.checks import WEIGHTLESS, check_scene, surface_of
from tests.studies.made_up_run import ATTRIBUTES, SCENE, run

pytestmark = pytest.mark.lab
FORCE, MEAN, NONE = (0.5, 0.1, 3.0), (0.2, 0.05, 1.0), (np.nan, np.nan, 1.0)
SOUND = dict.fromkeys(
    ("alternation", "sway", "swing", "gained", "volume_off", "unbalanced", "unsettled", "missed_at_outlines"), 0.0
)
SOUND |= {"crossed": 0.0} | dict.fromkeys(("pace", "shortened", "heaviness"), 1.0)
NUMBERS = [2, 3, 62, 17, 18, 19, 67]
"""Of seed 7: a member for each load, none of a scan; at the first places of 62 and 67 the probe comes near the hold."""
WORDS = "squeeze", "plane", "sphere", "hanging", "filled", "pulled", "capsule"


def test_a_member_does_not_depend_on_those_before_and_its_load_stays_clear_of_what_is_held():
    scenes = [member(7, number) for number in NUMBERS]
    assert member(7, NUMBERS[-1]) == scenes[-1] != member(8, NUMBERS[-1])
    assert len(LOADS) == len(WORDS) and all(map(str.__contains__, [scene.title for scene in scenes], WORDS))
    for scene in scenes:
        points, triangles = surface_of(scene.organ, scene.name)
        middle = points[triangles].mean(axis=1)
        held = middle[scene.held[0].region.level(middle) <= 0.0]
        assert len(held) and check_scene(scene) == []
        for obstacle in scene.obstacles:
            assert obstacle.gap(middle, 0.0).min() > 0.0 > obstacle.gap(middle, END).min()
            assert obstacle.gap(held, END).min() >= CLEAR - 1e-5
        for pulled in scene.held[1:]:
            assert pulled.region.level(held).min() > 0.0 < np.linalg.norm(pulled.path(END))


def test_a_member_of_a_scan_is_skipped_with_a_sentence():
    with pytest.raises(StudyError, match="--scans FOLDER"):
        [member(7, number) for number in range(20)]


@pytest.mark.parametrize(
    ("force", "mean", "truth"),
    [
        (FORCE, MEAN, "right"),
        (FORCE, NONE, "right"),
        ((-3.1, 0.1, 3.0), MEAN, "wrong"),
        ((-9.2, 0.1, 3.0), MEAN, "far"),
        ((-9.2, 0.9, 3.0), MEAN, "wrong"),  # the reference may be so far off that it is less than 9 %
        ((-30.0, 5.0, 3.0), MEAN, "far"),  # and here not
        (FORCE, (0.7, 0.4, 1.0), "undecided"),
        (FORCE, (0.5, 0.4, 1.0), "right"),  # wherever in its bar the reference is
        (FORCE, (1.5, 0.4, 1.0), "wrong"),
        (NONE, NONE, "undecided"),
    ],
)
def test_truth(force, mean, truth):
    assert Outcome("", "", "ok", errors={"force": force, "displacement": mean}).truth == truth


@pytest.mark.parametrize(
    ("force", "half", "inside"),
    [((-1.2, 0.9, 3.0), 1.3, True), ((-1.2, 0.9, 3.0), 1.1, False), ((1.2, 1.1, 3.0), 1.3, None), (NONE, 1.3, None)],
)
def test_an_error_that_the_reference_decides_is_inside_its_interval_or_not(force, half, inside):
    one = Outcome("", "", "ok", errors={"force_end": force}, signs={"within_force": half})
    assert one.inside("force", "force_end") is inside
    assert replace(one, signs={}).inside("force", "force_end") is one.inside("displacement", "mean_error") is None


@pytest.mark.parametrize(
    ("told", "signs", "answer"),
    [
        ("ok", {}, "silent"),
        ("ok", {"shortened": 3.0, "pace": 1.3, "unbalanced": 0.1}, "silent"),
        ("ok", {"pace": 1.3, "sway": 0.03}, "doubted"),
        ("ok", {"also": ["mass='heavy' makes the body no heavier than its tissue: its weight"]}, "silent"),
        ("ok", {"also": [WEIGHTLESS]}, "silent"),
        ("ok", {"also": ["mass='heavy' makes the body no heavier than its tissue: it swings", "odd"]}, "doubted"),
        ("folded", {}, "not ok"),
        ("timed-out", {}, "not ok"),
        ("failed", {}, "refused"),
        ("skipped", {}, "refused"),
        (StudyError("no"), {}, "refused"),
        (ZeroDivisionError("0"), {}, "crashed"),
    ],
)
def test_what_a_user_is_told(told, signs, answer, tmp_path, monkeypatch):
    def measured(case):
        if isinstance(told, Exception):
            raise told
        attributes = ATTRIBUTES | SOUND | signs
        warnings = "; ".join([*remarks(SCENE, attributes), *attributes.pop("also", [])])
        return replace(run().record, status=told, attributes=attributes | {"warnings": warnings})

    monkeypatch.setattr(outcome, "measure", measured)
    one = outcome._ended(tmp_path, "", lambda: run().case, SCENE, {})[0]
    assert one.kind.split(",")[0] == answer, one.message


def test_the_two_meshes_of_a_member_are_judged_unless_its_reference_is_doubted(tmp_path, monkeypatch):
    assert outcome.two_meshes(tmp_path, SCENE) == []
    judge, asked = SimpleNamespace(warnings=""), []
    monkeypatch.setattr(outcome, "reference_for", lambda root, scene: judge)
    monkeypatch.setattr(outcome, "read_record", lambda path: asked.append(path) or run().record)
    assert [one.reference for one in outcome.two_meshes(tmp_path, SCENE)] == [judge, judge]
    assert [path.name.split("-")[2] for path in asked] == ["1194", "1594"]
    judge.warnings = "off the shape"
    assert [one.reference for one in outcome.two_meshes(tmp_path, SCENE)] == [None, None]


def test_what_was_interrupted_continues_and_a_silent_body_that_is_far_off_fails(tmp_path, monkeypatch, capfd):
    """Members 0, 1, 6 and 8 to 12 of seed 7 are of scans: they are skipped, and drawn again when there are some."""

    def told(root, scene, nodes):
        far = scene.name.endswith("0003")
        return [(Outcome("uniform", "recipe", "ok", errors={"force": (90.0, 0.1, 3.0) if far else FORCE}), None)]

    monkeypatch.setattr(command, "told", told)
    line = ["--seed", "7", "--results", str(tmp_path), "--scenes"]
    assert [command.main([*line, count]) for count in ("3", "4", "4")] == [0, 1, 1]
    text = capfd.readouterr().out
    assert (
        "more than 3 targets off: 1 (" in text
        and "forces inside their interval: 0 of 0 (of 100: 90)" in text
        and f"--results {tmp_path} --most {MOST:g} --seconds 900 --member 3\n" in text
        and text.count("member 1 is skipped: its organ is a scan") == 3
        and [text.count(f"{number}: ") for number in (2, 3)] == [1, 1]
    )
    assert command.main([*line, "2", "--member", "3"]) == 1 and "\n3: " in capfd.readouterr().out


def test_a_member_that_takes_too_long_or_crashes_is_named_with_what_it_had_found(tmp_path, monkeypatch, capfd):
    def judge(root, scene, ended):
        while scene.name.endswith("0002"):
            pass
        os.kill(os.getpid(), signal.SIGKILL)

    monkeypatch.setattr(command, "told", lambda *_: [(Outcome("uniform", "recipe", "ok"), None)])
    monkeypatch.setattr(command, "judge", judge)
    line = ["--seed", "7", "--results", str(tmp_path), "--scenes", "4", "--seconds", "1"]
    assert command.main(line) == command.main(line) == 0
    lines = capfd.readouterr().out.splitlines()
    assert lines.count("members that did not end: 2 of 2") == 2 and "| all | 0 | 0 | 0 | 2 |" in "\n".join(lines)
    assert [line[-17:] for line in lines if line.startswith("  2: ")] == ["stopped after 1 s"] * 2
    assert [line[-25:] for line in lines if line.startswith("  3: ")] == ["its process ended with -9"] * 2


def test_loads_are_called_measured_up_to_the_largest_that_are_drawn():
    planes, tools, pulls, _, fills = LARGEST.values()
    assert planes == max(PRESS[1], SQUEEZE[1]) and tools == BEHIND and pulls == PULL[1]
    assert fills == pytest.approx(FILLED[1] - 1.0)
