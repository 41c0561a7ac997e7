import gc
import os

import numba
import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from studies.base.errors import StudyError
from studies.metrics.timing.protocol import FrameTiming, interleave, pinned


def test_pinned_to_one_core_and_one_thread_and_back():
    threads = numba.get_num_threads()
    if not hasattr(os, "sched_getaffinity"):
        with pinned() as core:
            assert core is None
        return
    before = os.sched_getaffinity(0)
    with pytest.raises(RuntimeError, match="inside"), pinned() as core:
        assert os.sched_getaffinity(0) == {core}
        assert {frozenset(os.sched_getaffinity(int(task))) for task in os.listdir("/proc/self/task")} == {
            frozenset({core})
        }
        assert numba.get_num_threads() == 1
        raise RuntimeError("inside")
    assert os.sched_getaffinity(0) == before
    assert numba.get_num_threads() == threads


def test_linear_algebra_uses_no_more_threads_than_the_timing():
    """A pool that waits for work on the pinned core takes every other slice of time from what is measured."""
    np.ones((2, 2)) @ np.ones((2, 2))
    with threadpool_limits(2):
        assert 2 in {pool["num_threads"] for pool in threadpool_info()}
        with pinned(threads=1):
            assert {pool["num_threads"] for pool in threadpool_info()} == {1}


def test_turns_are_taken_and_the_warm_up_is_thrown_away():
    calls: list[str] = []

    def contestant(name, frames):
        def run():
            calls.append(name)
            assert not gc.isenabled()
            return np.full(frames, len(calls))

        return run

    times = interleave({"a": contestant("a", 2), "b": contestant("b", 3)}, repeats=3, warmups=1)
    assert "".join(calls) == "ba" + "ab" + "ba" + "ab"
    np.testing.assert_array_equal(times["a"], [[3, 3], [6, 6], [7, 7]])
    np.testing.assert_array_equal(times["b"], [[4] * 3, [5] * 3, [8] * 3])
    assert gc.isenabled()


LENGTHS = iter([2, 2, 3])
REFUSED = [
    (lambda: interleave({}, 3), "timing needs a contestant and at least one repeat"),
    (lambda: interleave({"a": lambda: np.ones(2)}, 0), "timing needs a contestant and at least one repeat"),
    (lambda: interleave({"a": lambda: np.ones(next(LENGTHS))}, repeats=2), "'a' must return the same number"),
    *(
        (lambda frame_ns=frame_ns: FrameTiming(frame_ns), "frame times must be positive")
        for frame_ns in (np.ones(3), np.ones((0, 3)), np.zeros((2, 2)), np.full((1, 2), np.nan))
    ),
]


@pytest.mark.parametrize(("call", "sentence"), REFUSED)
def test_what_is_no_timing_is_refused(call, sentence):
    with pytest.raises(StudyError, match=sentence):
        call()
    assert gc.isenabled()
