"""Variants of HCJ05 that keep one volume: exact steps, stability, energy."""

import numpy as np
import pytest

from massspring import (
    Attachment,
    Baumgarte,
    Clock,
    ImplicitVolume,
    PostStabilization,
    Projection,
    Ramp,
    Setup,
    Shake,
    simulate,
    step_limit,
)
from massspring.analysis.stiffness import spring_stiffness, volume_hessian
from massspring.kernels.contact.node_contact import FREE, SLIDES
from massspring.kernels.forces.volume import enclosed_volume
from massspring.methods.families.one_volume import Rule, advance_by, correct_positions
from massspring.methods.method import begin_frame
from tests.massspring.kernels.forces.test_forces import volume_and_gradient
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
    _, slope = volume_and_gradient(body.rest, body.triangles)
    assert abs((slope * after.v).sum()) < 1e-12 * (np.abs(slope) * np.abs(after.v)).sum(), "the rate of V is not 0"


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
    _, slope = volume_and_gradient(before.x, ball_body.triangles)
    pushed = (state.v - state.nodes.v_star) / clock.dt * ball_body.mass[:, None] - state.lam[0] * slope
    scale = state.lam[0] * np.abs(slope).max()
    assert np.abs(pushed[free]).max() < 1e-9 * scale
    normal = state.contacts.normal[touched]
    along = (pushed[touched] * normal).sum(axis=1)
    assert np.abs(pushed[touched] - along[:, None] * normal).max() < 1e-9 * scale
    assert along.min() > -1e-9 * scale, "an obstacle pulls"


CALM_FRAMES = 120


def filled(body, method, damping):
    """Frames of 50 steps at dt_c/2 of a body that is filled to 1.3 V0 within 2 s; damped, it has come to rest then."""
    steps, dt = 50, 0.5 * step_limit(body).undamped
    grow = Ramp((0.0, 2.0), (1.0, 1.3))
    setup = Setup(body, method, Clock(steps * dt, CALM_FRAMES, steps), damping=damping, targets={"whole": grow})
    assert not setup.ramped
    return setup


def come_to_rest(body, method):
    """The state at 1.3 V0."""
    setup = filled(body, method, damping=40.0)
    state = setup.start()
    for number in range(CALM_FRAMES):
        state = method.advance(state, setup.boundary(number))
    return state


def kinetic_growth(body, method, seconds):
    """Exponential rate of the kinetic energy [1/s] about the balance of springs and pressure at 1.3 V0, undamped."""
    state = come_to_rest(body, method)
    state.nodes.v[:] += 1e-6 * np.random.default_rng(2).normal(size=body.rest.shape)
    setup = filled(body, method, damping=0.0)
    frames = round(seconds / setup.clock.frame)
    energy = []
    for number in range(frames):
        state = method.advance(state, setup.boundary(CALM_FRAMES + number))
        energy.append(0.5 * float(body.mass @ (state.v**2).sum(axis=1)))
    late = np.arange(frames // 2, frames)
    return np.polyfit(late * setup.clock.frame, np.log(energy)[late], 1)[0]


def fastest_mode(body):
    """dt lam max φᵀHφ [1/s] over the modes φ, φᵀMφ = 1, of springs and pressure that keep the volume (eq. 10.4)."""
    state = come_to_rest(body, Shake())
    x, size = state.x, body.rest.size
    stiffness, hessian = (m.toarray() for m in (spring_stiffness(body, x), volume_hessian(body.triangles, x)))
    root = np.repeat(1 / np.sqrt(body.mass), 3)
    normal = volume_and_gradient(x, body.triangles)[1].ravel() * root
    keeps = np.eye(size) - np.outer(normal, normal) / (normal @ normal)
    lam, hessian = state.lam[0], root[:, None] * hessian * root
    scaled = keeps @ (root[:, None] * stiffness * root - lam * hessian) @ keeps
    _, modes = np.linalg.eigh((scaled + scaled.T) / 2)
    return 0.5 * step_limit(body).undamped * lam * np.einsum("ij,ik,kj->j", modes, hessian, modes).max()


def test_projection_gains_energy_under_pressure_as_predicted_and_hcj05_does_not(ball_body):
    """A gradient one step ahead is a negative damping dt lam H; in the end the fastest mode dominates."""
    predicted = fastest_mode(ball_body)
    assert predicted > 1.0
    assert kinetic_growth(ball_body, Projection(), 3.0) == pytest.approx(predicted, rel=0.15)
    for method in (ImplicitVolume(), Shake(), PostStabilization(), Baumgarte()):
        assert abs(kinetic_growth(ball_body, method, 3.0)) < 0.05 * predicted
