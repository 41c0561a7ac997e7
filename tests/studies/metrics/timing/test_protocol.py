import gc
import os

import numba
import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from studies.base.errors import StudyError
from studies.metrics.timing import protocol
from studies.metrics.timing.protocol import FrameTiming, interleave, pinned, processor_seconds, share_of_others


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
            return np.outer([10, 9], np.full(frames, len(calls)))

        return run

    times = interleave({"a": contestant("a", 2), "b": contestant("b", 3)}, repeats=3, warmups=1)
    assert "".join(calls) == "ba" + "ab" + "ba" + "ab"
    np.testing.assert_array_equal(times["a"].frame_ns, 10 * np.array([[3, 3], [6, 6], [7, 7]]))
    np.testing.assert_array_equal(times["b"].cpu_ns, 9 * np.array([[4] * 3, [5] * 3, [8] * 3]))
    assert gc.isenabled()


@pytest.mark.parametrize(
    ("after", "share"),
    [
        ((110.0, 56.0, 21.0), 0.5),
        ((110.0, 51.0, 21.0), 0.0),
        ((110.0, 50.9, 21.0), 0.0),  # its ticks are rounded down
        ((100.5, 50.5, 20.0), None),  # too short to tell
        ((110.0, 50.0, 25.0), None),  # the counters do not hold this process
    ],
)
def test_the_load_of_others_is_what_is_busy_without_this_process(after, share):
    """Of 100 s of processor time 50 were busy, 20 of them for this process."""
    before = np.array([100.0, 50.0, 20.0])
    assert share_of_others(before, np.array(after)) == share
    assert share_of_others(None, before) is None


def test_the_counters_of_the_system_are_read(tmp_path, monkeypatch):
    """proc(5): user, nice, system, idle, waiting, interrupts, software interrupts, stolen, and guests, which are in
    user."""
    monkeypatch.setattr(protocol, "STAT", tmp_path / "stat")
    assert processor_seconds() is None
    (tmp_path / "stat").write_text("cpu  100 200 300 5000 50 10 20 30 100 0\ncpu0 9 9 9 9 9 9 9 9 9 9\n")
    monkeypatch.setattr(protocol.os, "sysconf", {"SC_CLK_TCK": 100}.__getitem__)
    whole, busy, _ = processor_seconds()
    assert (whole, busy) == pytest.approx((57.1, 6.6), rel=1e-12)


LENGTHS = iter([2, 2, 3])
REFUSED = [
    (lambda: interleave({}, 3), "timing needs a contestant and at least one repeat"),
    (lambda: interleave({"a": lambda: np.ones(2)}, 0), "timing needs a contestant and at least one repeat"),
    (lambda: interleave({"a": lambda: np.ones((2, next(LENGTHS)))}, repeats=2), "'a' must return the same number"),
    *(
        (lambda frame_ns=frame_ns: FrameTiming(frame_ns), "frame times must be positive")
        for frame_ns in (np.ones(3), np.ones((0, 3)), np.zeros((2, 2)), np.full((1, 2), np.nan))
    ),
    *(
        (lambda cpu_ns=cpu_ns: FrameTiming(np.ones((1, 2)), cpu_ns=cpu_ns), "processor times must")
        for cpu_ns in (np.ones((2, 2)), np.full((1, 2), -1), np.full((1, 2), np.nan))
    ),
]


@pytest.mark.parametrize(("call", "sentence"), REFUSED)
def test_what_is_no_timing_is_refused(call, sentence):
    with pytest.raises(StudyError, match=sentence):
        call()
    assert gc.isenabled()
