"""Single precision: the same code, the same answer up to its digits; and nothing is allocated inside a frame."""

from dataclasses import replace

import numpy as np
import pytest
from numba.core.runtime import _nrt_python as _nrt
from numba.core.runtime import rtsys

from massspring import Attachment, Free, ImplicitVolume, MassSpringError, Setup, simulate
from massspring.kernels.contact.node_contact import round_gap
from massspring.layout.allocate import start
from massspring.run.precision import KEPT_DOUBLE, in_precision
from tests.massspring.gathered import gather_and_predict
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


def test_float32_keeps_its_digits_a_metre_from_the_origin(ball_body):
    """Seen from the origin V would be a difference of numbers 1e4 times as large: 1e-3 of it would be left."""
    far = replace(ball_body, rest=ball_body.rest + 1.0)
    state = in_precision(start(far), "float32")
    boundary = Setup(far, ImplicitVolume(), clock_for(far, 1, 1)).boundary(0)
    volume = gather_and_predict(state.model, state.nodes, state.work, boundary, True)[0]
    assert volume == pytest.approx(far.volume, rel=2 * SINGLE * 1.0 / 0.01)  # positions round by 1e-7 m of 0.05 m


def test_the_state_is_in_single_precision_but_for_sums(kept_body):
    state = Setup(kept_body, ImplicitVolume(), clock_for(kept_body, 1, 1), precision="float32").start()
    parts = [state.model, state.model.slices, state.nodes, state.contacts, state.work]
    parts += [state.rows] if state.rows is not None else []
    for part in parts:
        for name, value in part._asdict().items():
            if isinstance(value, np.ndarray) and value.dtype.kind == "f":
                assert value.dtype == (np.float64 if name in KEPT_DOUBLE else np.float32), name


def test_float64_is_the_state_itself(ball_body):
    state = start(ball_body)
    assert in_precision(state, "float64") is state


def test_what_is_no_precision_is_refused(ball_body):
    with pytest.raises(MassSpringError, match="'float16'; choose float64 or float32"):
        Setup(ball_body, Free(), clock_for(ball_body, 1, 1), precision="float16")  # pyright: ignore[reportArgumentType]


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
