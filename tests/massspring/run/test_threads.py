"""Several threads at one frame: the same bits as one, whatever the number; and they go home after every frame."""

import threading
import time

import numpy as np
import pytest

from massspring import (
    Attachment,
    Clock,
    Free,
    ImplicitVolume,
    MassSpringError,
    Setup,
    Sphere,
    Trajectory,
    Volumes,
    simulate,
    surface_body,
)
from massspring.analysis.stability import step_limit
from massspring.kernels.jit.blocks import BLOCK
from massspring.kernels.jit.thread_team import JOB, JOB_END, JOB_SPRINGS, fork, join, team_of
from massspring.layout.threads import shared, team_at_work
from tests.massspring.conftest import SOFT, icosphere

RADIUS = 0.05


@pytest.fixture(scope="module")
def ball():
    """642 nodes in ten slices: every thread of three has some, and the last block of nodes is not full."""
    return surface_body(*icosphere(3, RADIUS), SOFT)


@pytest.fixture(autouse=True)
def many_cores(monkeypatch):
    """The number of cores decides what pays, not what is right: threads on one core take turns."""
    monkeypatch.setattr("massspring.run.checks.cores", lambda: 4)


def slid(body, method, **options) -> Setup:
    """A ball into which a sphere goes by a tenth of the radius while it slides; 4 frames of 10 steps."""
    clock = Clock(10 * 0.5 * step_limit(body).undamped, 4, 10)
    way = Trajectory((0.0, clock.duration), ((0.0, 0.0, 0.0), (0.2 * RADIUS, 0.0, -0.1 * RADIUS)))
    sphere = Sphere((0.0, 0.0, 1.3 * RADIUS), 0.3 * RADIUS, way, friction=0.3)
    held = (Attachment(np.flatnonzero(body.rest[:, 2] < -0.8 * RADIUS)),)
    return Setup(body, method, clock, (sphere,), held, gravity=(0.0, 0.0, -9.81), damping=40.0, **options)


CASES = [(Free(), "float64"), (ImplicitVolume(), "float64"), (ImplicitVolume(), "float32")]


@pytest.mark.parametrize(("method", "precision"), CASES, ids=["free", "kept", "kept in float32"])
def test_threads_change_no_bit(ball, method, precision):
    alone = simulate(slid(ball, method, precision=precision))
    assert np.abs(alone.contact_force).max() > 0
    for threads in (2, 3):
        together = simulate(slid(ball, method, precision=precision, threads=threads))
        for name in ("final", "volume", "pressure", "contact_force", "held_force"):
            assert np.array_equal(getattr(together, name), getattr(alone, name)), (threads, name)


def test_threads_search_all_nodes_where_obstacles_are_in_that_step(ball):
    """Also those that nothing comes near: their distances show whether they were searched."""
    gaps = []
    for threads in (1, 2, 3):
        setup = slid(ball, Free(), threads=threads)
        gaps.append(setup.method.advance(setup.start(), setup.boundary(0)).contacts.predicted_gap)
    assert np.array_equal(gaps[0], gaps[1]) and np.array_equal(gaps[0], gaps[2])


def test_each_thread_writes_on_scratch_of_its_own(ball):
    setup = slid(ball, Free(), threads=2)
    state = setup.start()
    work, team, untouched = state.work, state.team, -7.0
    work.tile[:] = untouched
    with team_at_work(state.frame(setup.boundary(0)), state.nodes.gradient):
        fork(team, JOB_SPRINGS, 0, 0.0)
        join(team)
    assert (work.tile[0] == untouched).all() and not (work.tile[1] == untouched).all()


def test_threads_change_no_bit_of_several_volumes(filled_ball):
    body = filled_ball.keeping(Volumes.regions(filled_ball, 3))
    alone, together = (simulate(slid(body, ImplicitVolume(), threads=threads)) for threads in (1, 2))
    assert np.array_equal(alone.final, together.final)
    assert np.array_equal(alone.pressure, together.pressure)


def test_every_slice_and_node_has_one_thread():
    rows = np.array([0, 10, 11, 40, 41, 42, 80])
    for threads, nodes in ((2, 3 * BLOCK + 5), (3, 3 * BLOCK + 5), (7, 3 * BLOCK + 5), (30, BLOCK + BLOCK // 2 + 5)):
        team = team_of(threads, rows, nodes, BLOCK)
        for borders, end in ((team.slices, 6), (team.nodes, nodes)):
            assert borders[0] == 0 and borders[-1] == end and (np.diff(borders) >= 0).all()
        assert np.isin(team.nodes, [*range(0, nodes, BLOCK), nodes]).all()


def test_the_load_is_even():
    rows = np.r_[0, np.cumsum(np.random.default_rng(2).integers(5, 20, 300))]
    team = team_of(4, rows, 64 * 300, BLOCK)
    load = np.diff(rows[team.slices])
    assert np.ptp(load) <= 2 * 20, "more than a slice too many at either end"
    assert np.array_equal(np.diff(team.nodes), [64 * 75] * 4)


def test_a_frame_that_fails_sends_the_threads_home(ball):
    setup = slid(ball, ImplicitVolume(), threads=2)
    state, boundary = setup.start(), setup.boundary(0)
    with pytest.raises(RuntimeError, match="halfway"), team_at_work(state.frame(boundary), state.nodes.gradient):
        raise RuntimeError("halfway")
    assert state.team is not None and state.team.signal[JOB] == JOB_END
    before = time.thread_time_ns(), time.process_time_ns()
    time.sleep(0.2)
    spent = time.process_time_ns() - before[1] - (time.thread_time_ns() - before[0])
    assert spent < 0.1e9, "a thread still looks for work"
    # And the next frame finds them again.
    after = setup.method.advance(state, boundary)
    assert np.array_equal(after.x, setup.method.advance(slid(ball, ImplicitVolume()).start(), boundary).x)


def test_without_threads_none_is_made(ball):
    before = threading.active_count()
    setup = slid(ball, ImplicitVolume())
    assert setup.start().team is None
    simulate(setup)
    assert threading.active_count() == before


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "2"])
def test_what_is_no_number_of_threads(ball, threads):
    with pytest.raises(MassSpringError, match="is not a number of threads; give 1 or more"):
        slid(ball, Free(), threads=threads)


def test_more_threads_than_cores(ball):
    with pytest.raises(MassSpringError, match="5 threads need as many cores, this process may use 4"):
        slid(ball, Free(), threads=5)


def test_a_method_that_runs_on_one_thread(ball):
    from massspring import Shake

    with pytest.raises(MassSpringError, match="'shake' runs on one thread"):
        slid(ball, Shake(), threads=2)


def test_scratch_of_its_own_for_each_thread(ball):
    state = slid(ball, Free()).start()
    together = shared(state, 3)
    assert together.work.tile.shape[0] == 3 and together.work.tile.dtype == state.work.tile.dtype
    assert together.nodes is state.nodes
