"""Which loads are larger than any with which errors were measured."""

import re
from dataclasses import replace

import numpy as np
import pytest

from massspring import Capsule, Ramp, Sphere, Trajectory
from studies import BALL_CLAMPED, BALL_SQUEEZE, BLADDER_FILL, LIVER_PROBE, SCENES, SPLEEN_SAG
from studies.catalog.checks import check_study
from studies.catalog.of_scene import study_of
from studies.metrics.load_size import beyond
from studies.scene.checks import surface_of


def larger(scene):
    return beyond(scene, surface_of(scene.organ, scene.name)[0])


def farther(one, factor):
    moved = tuple(tuple(factor * x for x in row) for row in one.path.displacements)
    return replace(one, path=Trajectory(one.path.times, moved))


def pressed(scene, factor):
    return replace(scene, obstacles=tuple(farther(one, factor) for one in scene.obstacles))


def pulled(factor):
    return replace(BALL_CLAMPED, held=tuple(farther(one, factor) for one in BALL_CLAMPED.held))


def filled(share):
    return replace(BLADDER_FILL, lumen=replace(BLADDER_FILL.lumen, filling=Ramp((0.0, 1.0), (1.0, share))))


def test_the_catalogue_is_within_what_was_measured():
    assert [larger(scene) for scene in SCENES] == [""] * len(SCENES)


@pytest.mark.parametrize(
    ("within", "more", "words"),
    [
        # Each plane goes 15 of 100 mm into the ball, after 0 to 2 mm of way.
        (pressed(BALL_SQUEEZE, 1.4), pressed(BALL_SQUEEZE, 2.6), "planes go into the organ by 0.7"),
        (pressed(LIVER_PROBE, 2.0), pressed(LIVER_PROBE, 8.0), "a sphere or capsule goes into the organ by"),
        (pulled(2.0), pulled(2.2), "a clamped region moves by 0.159 of"),  # of 0.072 of the size
        (SPLEEN_SAG, replace(SPLEEN_SAG, gravity=(0.0, 0.0, -12.0)), "its weight rho g L is 0.54"),
        (filled(1.29), filled(1.31), "its lumen changes by 0.31"),
        (filled(0.71), filled(0.69), "its lumen changes by 0.31"),
    ],
)
def test_a_load_that_is_larger_is_named(within, more, words):
    assert larger(within) == ""
    assert larger(more).startswith(words) and larger(more).count("measured up to") == 1


@pytest.mark.parametrize("thin", [True, False])
@pytest.mark.parametrize("rod", [0.0, 0.03])
def test_the_thickness_is_that_under_the_tool(thin, rod):
    """A tool goes 6 mm into a plate of 10 mm, or into the block of 100 mm to which it belongs."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-0.1, 0.1, 41), np.linspace(-0.1, 0.1, 41)))
    top = np.where(x > 0.0, 0.01, 0.1)
    points = np.concatenate([np.stack([x, y, 0.0 * x], axis=1), np.stack([x, y, top], axis=1)])
    side, height = (0.05, 0.021) if thin else (-0.05, 0.111)
    down = Trajectory(
        (0.0, 1.0, 9.0), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.007), (0.0, 0.0, -0.09))
    )  # the scene ends at 1 s
    start, end = ((side, sign * rod, height) for sign in (-1.0, 1.0))
    tool = Capsule(start, end, 0.01, down) if rod else Sphere(start, 0.01, down)
    words = beyond(replace(LIVER_PROBE, obstacles=(tool,), held=(), duration=1.0), points)
    numbers = [float(number) for number in re.findall(r"by ([\d.]+) of the thickness", words)]
    assert numbers == ([pytest.approx(0.6, abs=0.004)] if thin else []), words  # its first touch is known to a moment


def test_a_run_warns_of_them_before_it_starts():
    heavy = replace(SPLEEN_SAG, gravity=tuple(10 * g for g in SPLEEN_SAG.gravity))
    (sentence,) = check_study(study_of(heavy))
    assert "measured up to 0.5" in sentence and "errors are unknown" in sentence
    assert check_study(study_of(SPLEEN_SAG)) == []
