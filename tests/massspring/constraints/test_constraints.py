"""The relatives of HCJ05 that keep one volume: what each claims, against closed forms and against each other."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import (
    Attachment,
    Baumgarte,
    ImplicitVolume,
    MassSpringError,
    PostStabilization,
    Projection,
    Setup,
    Shake,
    simulate,
)
from massspring.kernels.contact.modes import FREE, SLIDES
from massspring.kernels.forces.volume import enclosed_volume
from massspring.methods.families.one_volume import Rule, advance_by, correct_positions
from massspring.methods.method import begin_frame
from tests.massspring.kernels.test_cubic import gradient
from tests.massspring.methods.test_methods import clock_for, squeeze, thrown


def pressed(body, method, clock):
    """Squeezed between planes, held at three nodes, under gravity."""
    held = (Attachment(body.surface_nodes[:3].astype(int)),)
    depth = 0.1 * np.ptp(body.rest[:, 2])
    return Setup(body, method, clock, squeeze(body, depth, clock.duration), held, (0.0, 0.0, -9.81), 20.0)


@pytest.mark.parametrize("method", [Shake(), Projection()], ids=["shake", "projection"])
def test_every_step_ends_at_the_exact_volume(body, method):
    """1e-12: round-off of the sum over triangles; with contact and held nodes inside; HCJ05 is 1e-7 to 1e-5 off."""
    history = simulate(pressed(body, method, clock_for(body, 200, 1)))
    rough = simulate(pressed(body, ImplicitVolume(), clock_for(body, 200, 1)))
    assert np.abs(history.contact_force).max() > 0.1, "nothing was pressed"
    assert np.abs(history.volume / body.volume - 1).max() < 1e-12
    assert np.abs(rough.volume / body.volume - 1).max() > 1e-8


def test_hcj05_is_one_rule_of_the_family(body):
    """What the loop that knows nothing else does, contact, held nodes and guards included.

    The two sum forces and gradients in another order; 200 steps with changing contacts make round-off 1e-12.
    """
    setup = pressed(body, ImplicitVolume(), clock_for(body, 10, 20))
    mine, other = setup.start(), setup.start()
    mine.nodes.x[:] *= 0.8  # so that the guard cuts
    other.nodes.x[:] = mine.x
    for frame in range(10):
        mine, other = (
            advance_by(Rule(), mine, setup.boundary(frame)),
            setup.method.advance(other, setup.boundary(frame)),
        )
        assert np.abs(mine.x - other.x).max() < 1e-11 * body.size
        assert mine.lam == pytest.approx(other.lam, rel=1e-8)
        for name in ("contact_impulse", "held_impulse"):
            expected = getattr(other.diagnostics, name)
            assert np.allclose(getattr(mine.diagnostics, name), expected, rtol=0, atol=1e-8 * np.abs(expected).max())
        for name in ("limited", "singular"):
            assert np.array_equal(getattr(mine.diagnostics, name), getattr(other.diagnostics, name))


def test_hcj05_is_the_first_newton_step_of_shake(body):
    """Their pressures differ by the second derivative along the step only: ∝ dt."""
    gaps = []
    for fraction in (0.4, 0.2, 0.1):
        clock = clock_for(body, 1, 1, fraction)
        pressures = []
        for method in (Shake(), ImplicitVolume()):
            setup = Setup(body, method, clock, velocity=thrown(body), damping=20.0)
            pressures.append(setup.method.advance(setup.start(), setup.boundary(0)).lam[0])
        gaps.append(abs(pressures[0] - pressures[1]))
    assert gaps[0] > 1e-6
    # vᵀHv stays as dt goes to 0; the rest falls with dt.
    assert gaps[1] - gaps[2] == pytest.approx(0.5 * (gaps[0] - gaps[1]), rel=0.2)


def hessian_along(body, v):
    """vᵀ H v by central differences of G·v along v [m³/s²]: V is a cubic, so they are exact."""
    step = 1e-3 * body.size / np.abs(v).max()
    after, before = (gradient(body.rest + s * v, body.triangles)[1] for s in (step, -step))
    return float(((after - before) * v).sum() / (2 * step))


def test_baumgarte_at_hcj05_s_rates_differs_by_the_convective_term(body):
    clock, v = clock_for(body, 1, 1), thrown(body)
    pressures = []
    for method in (Baumgarte(alpha=0.5, beta=1.0), ImplicitVolume()):
        setup = Setup(body, method, clock, velocity=v)
        state = setup.start()
        state.nodes.x[:] *= 1.0001
        pressures.append(method.advance(state, setup.boundary(0)).lam[0])
    moved = replace(body, rest=1.0001 * body.rest)
    _, slope = gradient(moved.rest, body.triangles)
    mobility = float(((slope**2).sum(axis=1) / body.mass).sum())
    convective = hessian_along(moved, v) / mobility
    assert abs(convective) > 1e-3
    assert pressures[0] - pressures[1] == pytest.approx(-convective, rel=1e-9)


def volume_errors(body, method, steps, scale=1 + 1e-9):
    """V/V0 − 1 after each step of a body that is a little too large."""
    clock = clock_for(body, steps, 1, fraction=0.1)
    setup = Setup(body, method, clock)
    state = setup.start()
    state.nodes.x[:] *= scale
    errors = []
    for frame in range(steps):
        state = method.advance(state, setup.boundary(frame))
        errors.append(enclosed_volume(state.x, body.triangles) / body.volume - 1)
    return np.array(errors)


@pytest.mark.parametrize(("alpha", "beta"), [(0.5, 0.5), (0.3, 0.1), (0.05, 0.4)])
def test_baumgarte_lets_the_volume_follow_its_oscillator(ball_body, alpha, beta):
    """e⁺ = e + r, r⁺ = (1 − 2 alpha) r − beta² e exactly (eq. 10.6), from an error so small that all is linear."""
    errors = volume_errors(ball_body, Baumgarte(alpha, beta), 30)
    start = 3e-9
    e, r, expected = start, 0.0, []
    for _ in range(30):
        r = (1 - 2 * alpha) * r - beta**2 * e
        e += r
        expected.append(e)
    assert np.abs(errors - expected).max() < 2e-5 * start  # round-off of V is 1e-15, some 1e-6 of the error


@pytest.mark.parametrize(
    ("alpha", "beta", "stable"),
    [
        (0.5, np.sqrt(1.96), True),
        (0.5, np.sqrt(2.04), False),
        (0.9, np.sqrt(0.36), True),
        (0.9, np.sqrt(0.44), False),
        (0.97, 0.2, True),
        (1.01, 0.2, False),
    ],
)
def test_baumgarte_is_stable_up_to_its_limit(ball_body, alpha, beta, stable):
    """(beta dt)² + 4 alpha dt < 4, just below and just above; the error grows by 4 % a step or dies as slowly."""
    method = Baumgarte(alpha, float(beta))
    assert method.stable == stable
    errors = np.abs(volume_errors(ball_body, method, 300))
    assert errors[-1] < 0.1 * errors[:3].max() if stable else errors[-1] > 10 * errors[:3].max()


def test_baumgarte_s_rates_must_be_positive():
    for bad in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(MassSpringError, match="alpha is"):
            Baumgarte(alpha=bad)


def test_post_stabilization_moves_nodes_and_no_velocity(body):
    """The correction squares the error, as one Newton step does, and touches no bit of v."""
    setup = Setup(body, PostStabilization(), clock_for(body, 1, 1), velocity=thrown(body))
    state = setup.start()
    left = []
    for scale in (1.002, 1.001):
        moved = begin_frame(state, setup.boundary(0))
        moved.nodes.x[:] = scale * body.rest
        v = moved.v.copy()
        correct_positions(moved.model, moved.nodes, moved.contacts, body.volume, setup.clock.dt)
        assert np.array_equal(moved.v, v)
        left.append(enclosed_volume(moved.x, body.triangles) / body.volume - 1)
    assert left[0] / left[1] == pytest.approx(4.0, rel=0.02)
    after = setup.method.advance(state, setup.boundary(0))
    _, slope = gradient(body.rest, body.triangles)
    assert abs((slope * after.v).sum()) < 1e-12 * (np.abs(slope) * np.abs(after.v)).sum(), "the rate of V is not 0"


def test_a_body_crushed_to_a_thousandth_comes_back_in_one_step_of_shake(body):
    """The linear step without its guard asks for 1e6 times the length there is, and the run diverges."""
    setup = Setup(body, Shake(), clock_for(body, 400, 10), damping=30.0)
    state = setup.start()
    state.nodes.x[:] = 1e-3 * body.rest
    state = setup.method.advance(state, setup.boundary(0))
    for frame in range(1, 400):
        state = setup.method.advance(state, setup.boundary(frame))
        assert abs(enclosed_volume(state.x, body.triangles) / body.volume - 1) < 1e-11
    edges = body.springs.ends.astype(int)
    lengths = np.linalg.norm(state.x[edges[:, 1]] - state.x[edges[:, 0]], axis=1)
    assert np.abs(lengths / body.springs.rest_length - 1).max() < 1e-9, "it did not come back to its shape"
    wild = setup.start()
    wild = replace(wild, model=wild.model._replace(correction_limit=np.inf))
    wild.nodes.x[:] = 1e-3 * body.rest
    wild = advance_by(Rule(), wild, setup.boundary(0))
    assert not np.abs(wild.x).max() < 1e3 * body.size


def test_contact_and_held_nodes_are_inside_shake_s_multiplier(ball_body):
    """Outside truth, the conditions themselves: only n, held nodes and lam G push, and the volume is exact."""
    clock = clock_for(ball_body, 60, 1)
    setup = pressed(ball_body, Shake(), clock)
    state = setup.start()
    for frame in range(60):
        before, state = state, setup.method.advance(state, setup.boundary(frame))
    free = (state.model.inverse_mass > 0) & (state.contacts.mode == FREE)
    touched = state.contacts.mode == SLIDES
    assert touched.sum() > 3
    _, slope = gradient(before.x, ball_body.triangles)
    pushed = (state.v - state.nodes.v_star) / clock.dt * ball_body.mass[:, None] - state.lam[0] * slope
    scale = state.lam[0] * np.abs(slope).max()
    assert np.abs(pushed[free]).max() < 1e-9 * scale
    normal = state.contacts.normal[touched]
    along = (pushed[touched] * normal).sum(axis=1)
    assert np.abs(pushed[touched] - along[:, None] * normal).max() < 1e-9 * scale
    assert along.min() > -1e-9 * scale, "an obstacle pulls"
