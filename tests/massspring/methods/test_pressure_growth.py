"""A gradient taken one step ahead feeds oscillations under pressure: how fast, and that the others do not."""

import numpy as np
import pytest

from massspring import (
    Baumgarte,
    Clock,
    ImplicitVolume,
    PostStabilization,
    Projection,
    Ramp,
    Setup,
    Shake,
    step_limit,
)
from massspring.analysis.stiffness import spring_stiffness, volume_hessian
from tests.massspring.kernels.test_cubic import gradient

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
    normal = gradient(x, body.triangles)[1].ravel() * root
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
