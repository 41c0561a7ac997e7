"""Marks in the frame loop: they count every stage of every step, change no bit, and never book more than has passed."""

from dataclasses import replace
from time import perf_counter_ns

import numpy as np
import pytest

from massspring import METHODS, ImplicitSprings, Setup, Sphere
from massspring.kernels.jit.stage_clock import (
    BETWEEN_FRAMES,
    INTEGRATION,
    REVISION,
    SEARCH,
    SPRINGS,
    UNTIMED,
    new_stage_times,
    now,
)
from tests.massspring.conftest import body_of
from tests.massspring.methods.test_methods import clock_for, squeeze
from tests.massspring.rows import CONTESTANTS, rows

STEPS, FRAMES = 10, 3


@pytest.fixture(params=rows(method.name for method in METHODS))
def row(request):
    return request.param


@pytest.fixture
def method(row):
    return CONTESTANTS[row[0]]


@pytest.fixture
def kept_body(row, request):
    return body_of(row[1], request)


def run(setup, times=UNTIMED):
    """The last state, and how long the frames took [ns]."""
    state = setup.start()
    state = replace(state, diagnostics=state.diagnostics._replace(stage_times=times))
    elapsed = 0
    for frame in range(FRAMES):
        boundary = setup.boundary(frame)
        begin = perf_counter_ns()
        state = setup.method.advance(state, boundary)
        elapsed += perf_counter_ns() - begin
    return state, elapsed


def pressed(body, method):
    clock = clock_for(body, FRAMES, STEPS, method=method)
    return Setup(body, method, clock, squeeze(body, 0.003, clock.duration), damping=20.0)


def test_ticks_change_no_bit_and_count_every_step(kept_body, method):
    setup, times = pressed(kept_body, method), new_stage_times()
    plain, _ = run(setup)
    timed, elapsed = run(setup, times)
    assert np.array_equal(plain.x, timed.x) and np.array_equal(plain.v, timed.v)
    assert np.array_equal(plain.lam, timed.lam)
    assert times.ended[BETWEEN_FRAMES] == FRAMES
    assert times.ended[SEARCH] == times.ended[INTEGRATION] == FRAMES * STEPS
    passes = method.passes if isinstance(method, ImplicitSprings) else 1
    assert times.ended[SPRINGS] == passes * FRAMES * STEPS
    assert (times.spent[:BETWEEN_FRAMES] >= 0).all() and 0 < times.spent[:BETWEEN_FRAMES].sum() <= elapsed


def test_a_stage_that_a_scene_does_not_need_is_never_entered(kept_body, method):
    times = new_stage_times()
    setup = replace(pressed(kept_body, method), obstacles=())
    bare, _ = run(setup, times)
    assert times.ended[SEARCH] == times.ended[REVISION] == 0
    # Bit for bit the same with the stage: an obstacle that nothing ever reaches.
    far, _ = run(replace(setup, obstacles=(Sphere((100.0, 0.0, 0.0), 0.01),)), new_stage_times())
    assert np.array_equal(bare.x, far.x) and np.array_equal(bare.v, far.v)


def test_the_compiled_clock_is_the_one_of_python():
    import numba

    compiled_now = numba.njit(lambda: now())
    compiled_now()
    before, between, after = perf_counter_ns(), compiled_now(), perf_counter_ns()
    assert before <= between <= after
