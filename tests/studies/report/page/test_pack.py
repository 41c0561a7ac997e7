"""Packed positions and series are unpacked within the promised precision."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Capsule, Plane, Sphere, Trajectory
from studies.report.page.case_data import BINS, masses, obstacle_of, thinned
from studies.report.page.pack import pack_frames, pack_series
from studies.runs.recipes import QuadraticBody
from tests.studies.made_up_run import run
from tests.studies.report.page.unpack import unpack_frames, unpack_series

RANDOM = np.random.default_rng(5)
PROMISED = 1e-4
"""Of the size of the body."""


@pytest.mark.parametrize("move", [0.0, 2.0])
def test_positions_are_as_near_as_the_page_says(move):
    rest = RANDOM.normal(size=(200, 3))
    size = float(np.linalg.norm(np.ptp(rest, axis=0)))
    frames = rest + 0.01 * RANDOM.normal(size=(30, 200, 3)) + move * size * np.linspace(0, 1, 30)[:, None, None]
    packed = pack_frames(frames, size)
    gap = np.abs(unpack_frames(packed) - frames).max()
    assert 0.4 * packed["step"] < gap <= 0.5001 * packed["step"] <= PROMISED * size
    assert packed["shape"] == [30, 200]


def test_a_body_that_flies_away_is_packed_coarser_and_never_wrong():
    frames = np.array([0.0, 1e4, -1e4])[:, None, None] + RANDOM.normal(size=(3, 5, 3))
    packed = pack_frames(frames, 1.0)
    assert packed["step"] > PROMISED
    assert np.abs(unpack_frames(packed) - frames).max() <= 0.5001 * packed["step"]


@pytest.mark.parametrize(
    "values", [[0.0], [3.0, 3.0], [1e-300, 0.0], [1.0, np.nan, -2.5e7, np.inf], [np.nan, np.nan], [], [0.1, 0.2, 0.15]]
)
def test_series_come_back(values):
    given = np.array(values, dtype=float)
    series = unpack_series(pack_series(given))
    finite = np.isfinite(given)
    assert np.array_equal(np.isfinite(series), finite)
    span = np.ptp(given[finite]) if finite.any() else 0.0
    assert np.all(np.abs(series[finite] - given[finite]) <= span / 131_000)


def test_a_thinned_history_keeps_its_ends_and_peaks():
    t = np.arange(5000.0)
    values = np.sin(t / 700)
    values[[1234, 3456]] = 9.0, -9.0
    values[-1] = np.nan
    shown, kept = thinned(t, values)
    assert len(shown) <= 2 * BINS + 2 and shown[0] == 0 and shown[-1] == 4998 and np.all(np.diff(shown) > 0)
    assert {1234, 3456} <= set(shown) and kept.max() == 9.0 and kept.min() == -9.0
    assert np.array_equal(thinned(t[:50], values[:50])[0], t[:50])


def test_obstacles_move_as_the_scene_says():
    path, times = Trajectory((0.0, 2.0), ((0, 0, 0), (0, 0, -0.01))), np.array([0.0, 1.0, 3.0])
    moved = [[0.0, 0.0, 0.1 - z] for z in (0.0, 0.005, 0.01)]
    plane = obstacle_of(Plane((0.0, 0.0, 0.1), (0.0, 0.0, -2.0), path), times)
    assert plane["normal"] == [0.0, 0.0, -1.0] and np.allclose(plane["at"], moved)
    ball = obstacle_of(Sphere((0.0, 0.0, 0.1), 0.02, path), times)
    assert (ball["radius"], ball["span"]) == (0.02, [0.0, 0.0, 0.0]) and np.allclose(ball["at"], moved)
    rod = obstacle_of(Capsule((0.0, 0.0, 0.1), (0.3, 0.0, 0.1), 0.02, path), times)
    assert np.allclose(rod["span"], [0.3, 0.0, 0.0]) and np.allclose(rod["at"], moved)


@pytest.mark.parametrize(
    ("mass", "heaviness", "words"),
    [
        ("lumped", 1.0, ""),
        ("stiffness", 1.0, "shared otherwise than"),
        ("heavy", 1.0 + 1e-12, "shared otherwise than"),
        ("heavy", 6.91, "6.91 times as heavy as"),
    ],
)
def test_the_page_says_of_masses_that_are_not_the_tissues_that_the_motion_is_not_the_organs(mass, heaviness, words):
    made = run(attributes={"heaviness": heaviness})
    said = masses(replace(made, case=made.case.replaced(body=QuadraticBody(mass=mass))))
    assert words in said and ("does not move as the organ does" in said) == bool(words)
