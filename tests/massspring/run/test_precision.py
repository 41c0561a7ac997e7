"""Single precision: the same code, the same answer up to its digits, also far away; nothing is allocated in a frame."""

from dataclasses import replace

import numpy as np
import pytest
from numba.core.runtime import _nrt_python as _nrt
from numba.core.runtime import rtsys

from massspring import Attachment, Body, Free, ImplicitVolume, Probe, Setup, Sphere, Trajectory, simulate
from massspring.kernels.contact.node_contact import round_gap
from massspring.run.precision import KEPT_DOUBLE
from tests.massspring.methods.test_methods import clock_for, squeeze

SINGLE = float(np.finfo(np.float32).eps)
METHODS = (Free(), ImplicitVolume())


def pressed(body, method, precision="float64", frames=30) -> Setup:
    clock = clock_for(body, frames, 20)
    held = (Attachment(np.flatnonzero(body.rest[:, 0] < body.rest[:, 0].min() + 1e-3)),)
    depth = 0.1 * float(np.ptp(body.rest[:, 2]))
    planes = squeeze(body, depth, 0.5 * clock.duration)
    return Setup(body, method, clock, planes, held, damping=40.0, precision=precision)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_float32_gives_the_answer_of_float64_to_its_digits(kept_body, method):
    """600 steps: each rounds a position by half a bit; damping forgets them. 30 bits of the body's size are allowed."""
    single, double = (simulate(pressed(kept_body, method, p)) for p in ("float32", "float64"))
    assert np.abs(single.final - double.final).max() < 30 * SINGLE * kept_body.size
    assert np.abs(single.final - double.final).max() > 1e-12 * kept_body.size, "both ran in double precision"
    scale = np.abs(double.contact_force).max()
    assert scale > 0 and np.abs(single.contact_force - double.contact_force)[-1].max() < 1e-3 * scale


@pytest.mark.parametrize("axis", [(0.0, 0.0, 0.0), (0.01, 0.0, 0.03)], ids=["sphere", "capsule"])
def test_the_search_of_round_obstacles_stays_in_single_precision(axis):
    """Against the distance in double precision; a double in between would slow the loop, and show in the digits."""
    span, radius = np.array(axis, dtype=np.float32), np.float32(0.02)
    places = np.random.default_rng(1).uniform(-0.1, 0.1, size=(200, 3)).astype(np.float32)
    gaps = np.array([float(round_gap(tuple(r), tuple(span), radius)) for r in places])
    r, a = places.astype(np.float64), span.astype(np.float64)
    share = np.clip(r @ a / (a @ a), 0.0, 1.0)[:, None] if a.any() else 0.0
    exact = np.linalg.norm(r - share * a, axis=1) - float(radius)
    # Some six roundings of the distance and of the share of the axis, half a bit each, of 0.2 m at most.
    assert np.abs(gaps - exact).max() < 4 * SINGLE * 0.2
    assert np.array_equal(gaps, gaps.astype(np.float32)), "computed in double precision"


def test_float32_meets_the_volume_to_1e_5(kept_body):
    """V is summed from a node of the surface, and over slices in double precision; volumes of nodes are 1e-3 of it."""
    history = simulate(pressed(kept_body, ImplicitVolume(), "float32"))
    error = np.abs(history.volume[-1] / history.volume_target[-1] - 1).max()
    assert error < 1e-5


def test_the_state_is_in_single_precision_but_for_sums(kept_body):
    state = Setup(kept_body, ImplicitVolume(), clock_for(kept_body, 1, 1), precision="float32").start()
    parts = [state.model, state.model.slices, state.nodes, state.contacts, state.work]
    parts += [state.rows] if state.rows is not None else []
    for part in parts:
        for name, value in part._asdict().items():
            if isinstance(value, np.ndarray) and value.dtype.kind == "f":
                assert value.dtype == (np.float64 if name in KEPT_DOUBLE else np.float32), name


@pytest.fixture
def counted():
    """numba counts what its code allocates."""
    _nrt.memsys_enable_stats()
    yield
    _nrt.memsys_disable_stats()


@pytest.mark.usefixtures("counted")
@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_no_memory_is_allocated_for_a_step(kept_body, method):
    """What a frame allocates is its copy of the state: as much for two steps as for two hundred."""
    counts = []
    for steps in (2, 200):
        setup = replace(pressed(kept_body, method, frames=2), clock=clock_for(kept_body, 2, steps))
        state, boundary = setup.start(), setup.boundary(0)
        state = method.advance(state, boundary)  # compiles
        before = rtsys.get_allocation_stats().alloc
        method.advance(state, boundary)
        counts.append(rtsys.get_allocation_stats().alloc - before)
    assert counts[0] == counts[1]


FAR = np.array([10.0, -8.0, 6.0])
"""[m]; single precision has 1e-6 m there."""


def pressed_far(body: Body, method, precision: str, shift: np.ndarray) -> Setup:
    """All that has a place: two planes, a rough sphere that comes in, held nodes that are drawn aside, and a start away
    from rest."""
    clock = clock_for(body, 20, 20)
    depth, size = 0.05 * float(np.ptp(body.rest[:, 2])), float(np.ptp(body.rest[:, 0]))
    middle = body.rest.mean(axis=0)
    centre = np.array([body.rest[:, 0].max() + 0.5 * size, middle[1], middle[2]])
    still, inwards = (0.0, 0.0, 0.0), (-0.1 * size, 0.0, 0.0)
    ball = Sphere(tuple(centre + shift), 0.5 * size, Trajectory((0.0, clock.duration), (still, inwards)), 0.3)
    aside = Trajectory((0.0, clock.duration), (still, (0.0, 0.02 * size, 0.0)))
    held = Attachment(np.flatnonzero(body.rest[:, 0] < body.rest[:, 0].min() + 0.1 * size), aside)
    there = replace(body, rest=body.rest + shift)
    wide = middle + 0.99 * (body.rest - middle) + shift
    planes = squeeze(there, depth, 0.5 * clock.duration)
    return Setup(there, method, clock, (*planes, ball), (held,), damping=40.0, positions=wide, precision=precision)  # pyright: ignore[reportArgumentType]


def errors(body: Body, method, shift: np.ndarray) -> np.ndarray:
    """Of single precision against double, at the end of the run: positions over size, forces over the largest."""
    single, double = (simulate(pressed_far(body, method, precision, shift)) for precision in ("float32", "float64"))
    assert single.good_frames == double.good_frames == len(double.t)
    force = np.abs(double.contact_force).max()
    assert (np.abs(double.contact_force[-1]).max(axis=1) > 0).all(), "an obstacle touches nothing"
    x = np.abs(single.final - double.final).max() / body.size
    return np.array([x, np.abs(single.contact_force - double.contact_force)[-1].max() / force])


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_single_precision_at_ten_metres_is_as_good_as_at_the_origin(ball_body, method):
    """Kept as given, positions would be wrong by 2e-5 of the body's size as soon as they are stored."""
    here, there = errors(ball_body, method, np.zeros(3)), errors(ball_body, method, FAR)
    assert (here > 1e-12).all(), "both ran in double precision"
    assert (there < 5.0 * here).all() and there[0] < 3e-6


def test_a_state_is_relative_to_the_middle_of_the_body_at_the_start(ball_body):
    setup = pressed_far(ball_body, ImplicitVolume(), "float32", FAR)
    state, positions = setup.start(), setup.positions
    assert positions is not None and np.abs(state.nodes.x).max() < 0.51 * np.ptp(positions, axis=0).max()
    assert np.abs(state.x - positions).max() < 1e-8
    back = state.moved_to(positions + 0.01)
    assert np.abs(back.x - positions - 0.01).max() < 1e-8


def test_the_tip_of_a_probe_is_where_it_is_in_double_precision(ball_body):
    """Relative to the body, as all obstacles are."""
    far = replace(ball_body, rest=ball_body.rest + FAR)
    probe = Probe(tuple(FAR + 0.1), 0.0, Trajectory((0.0, 1.0), ((0, 0, 0), (0, 0, -0.1))))
    double = Setup(far, ImplicitVolume(), clock_for(far, 2, 3), (probe,))
    single = replace(double, precision="float32")
    for mine, theirs in zip(single.boundary(1).tips, double.boundary(1).tips, strict=True):
        assert np.abs(mine + single.origin - theirs).max() < 1e-14 and np.abs(mine).max() < 0.2
