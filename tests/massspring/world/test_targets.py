"""A target that jumps is ramped: what is followed never moves too fast, arrives, and throws nothing apart."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from massspring import Clock, ImplicitVolume, Ramp, Setup, Volumes, simulate, step_limit
from massspring.kernels.forces.springs import spring_energy
from massspring.world.targets import fastest_filling, followed

JUMP = 1.3


def marched(target: Ramp, rate: float, t: np.ndarray) -> np.ndarray:
    """What `followed` promises, by small steps: towards the target, never farther than rate · dt."""
    value, values = 1.0, [1.0]
    for before, now in itertools.pairwise(t):
        most = rate * (now - before)
        value += float(np.clip(target(now) - value, -most, most))
        values.append(value)
    return np.array(values)


@st.composite
def ramps(draw):
    count = draw(st.integers(1, 5))
    gaps = draw(st.lists(st.floats(1e-3, 1.0), min_size=count, max_size=count))
    values = draw(st.lists(st.floats(0.2, 3.0), min_size=count, max_size=count))
    return Ramp(tuple(np.cumsum(gaps) - draw(st.floats(0.0, 1.0))), tuple(values))


@pytest.mark.campaign
@settings(deadline=None)
@given(ramps(), st.floats(0.1, 20.0))
def test_what_is_followed_is_what_small_steps_towards_the_target_give(target, rate):
    end = max(target.times[-1], 0.0) + 3.0 / rate
    t = np.linspace(0.0, end, 4001)
    values = followed(target, rate)(t)
    # A small step turns a corner late, by its own length.
    assert np.abs(values - marched(target, rate, t)).max() < 2.5 * rate * (t[1] - t[0]) + 1e-12
    assert values[0] == pytest.approx(1.0, abs=1e-12)
    assert np.abs(np.diff(values)).max() <= rate * (t[1] - t[0]) * (1 + 1e-9) + 1e-12


def test_what_is_slow_is_followed_as_it_is():
    slow = Ramp((0.5, 1.0), (1.0, 1.5))
    assert followed(slow, 1.0) is slow
    assert followed(slow, 0.99) is not slow


def test_the_fastest_filling_is_the_shear_wave_s(block_body):
    """mu = 1,800 Pa and rho = 1,060 kg/m³ were put in: c = 1.303 m/s."""
    assert fastest_filling(block_body) == pytest.approx(np.sqrt(1800.0 / 1060.0) / block_body.size, rel=1e-12)


def blown_up(body, fraction: float, damping: float = 0.0):
    """The history of a body whose target volumes jump by 30 %, over several oscillations."""
    dt = fraction * step_limit(body).undamped
    jump = Ramp((0.0,), (JUMP,))
    with pytest.warns(UserWarning, match="limited to that rate"):
        setup = Setup(
            body,
            ImplicitVolume(),
            Clock(0.005, 60, int(np.ceil(0.005 / dt))),
            damping=damping,
            targets=dict.fromkeys(body.kept.names, jump),
        )
    return simulate(setup)


@pytest.mark.parametrize("kind", ["whole", "regions", "nodal"])
def test_a_jump_of_thirty_per_cent_throws_nothing_apart(block_body, kind):
    """Unramped the jump leaves some ten to a hundred times the elastic energy of the swollen body, the more the shorter
    the step, and turns tetrahedra inside out; ramped it leaves a fraction of it, whatever the step."""
    volumes = {"whole": Volumes.whole, "regions": lambda b: Volumes.regions(b, 7), "nodal": Volumes.nodal}[kind]
    body = block_body.keeping(volumes(block_body))
    net = body.springs
    swollen = spring_energy(JUMP ** (1 / 3) * body.rest, net.ends, net.rest_length, net.stiffness)
    peaks = []
    for fraction in (0.5, 0.1):
        history = blown_up(body, fraction)
        assert history.outcome == "finished" and history.limited_corrections == 0
        assert np.abs(history.volume[-1] / body.rest_volumes - JUMP).max() < 1e-3
        assert history.min_j.min() > 0.5
        peaks.append(history.kinetic.max())
    assert max(peaks) < 0.25 * swollen
    # Frames end at the same times; what differs is the phase of the stiffest modes.
    assert peaks[0] == pytest.approx(peaks[1], rel=0.1)
