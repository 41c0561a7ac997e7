"""Natural frequencies against a dense solver, and against the motion itself."""

import numpy as np
import pytest
from scipy.linalg import eigh, null_space

from massspring import Clock, ImplicitVolume, MassSpringError, Setup, step_limit
from massspring.analysis.modes import natural_frequencies
from massspring.analysis.stability import largest_frequency
from massspring.analysis.stiffness import stiffness_at_rest


def test_they_are_those_of_a_dense_solver(kept_body):
    """Outside truth: K projected on the null space of J, all eigenvalues by LAPACK."""
    free = null_space(kept_body.kept.jacobian(kept_body.rest).toarray())
    mass = np.repeat(kept_body.mass, 3)
    stiffness = free.T @ (stiffness_at_rest(kept_body) @ free)
    exact = eigh(stiffness, free.T @ (mass[:, None] * free), eigvals_only=True)
    omega, modes = natural_frequencies(kept_body, 14)
    scale = exact[-1]
    assert np.abs(omega[:6] ** 2).max() < 1e-7 * scale  # a free body: six rigid motions
    assert np.allclose(omega[6:] ** 2, exact[6:14], rtol=1e-6)
    assert np.allclose(np.einsum("kni,n,kni->k", modes, kept_body.mass, modes), 1.0, rtol=1e-9)


def test_volumes_only_raise_them(kept_body):
    """Constraints take freedom away: Courant and Fischer."""
    kept, free = (natural_frequencies(kept_body, 12, keep)[0] for keep in (True, False))
    assert (kept[6:] >= free[6:] * (1 - 1e-9)).all()
    assert largest_frequency(kept_body) >= free[-1]


def test_the_rows_are_derivatives_of_the_volumes(kept_body):
    x = kept_body.rest
    direction = np.random.default_rng(4).uniform(-1, 1, x.shape)
    step = 1e-6 * kept_body.size
    ahead, behind = (kept_body.kept.measure(x + sign * step * direction) for sign in (1, -1))
    exact = kept_body.kept.jacobian(x) @ direction.ravel()
    assert np.allclose((ahead - behind) / (2 * step), exact, rtol=1e-6, atol=1e-9 * np.abs(exact).max())


def test_a_mode_swings_at_its_frequency(kept_body):
    """A quarter of a period from full speed to standstill, by the method itself: within 0.5 % at an eighth of dt_c."""
    omega, modes = natural_frequencies(kept_body, 9)
    swing, shape = omega[6], modes[6]
    dt = 0.125 * step_limit(kept_body).undamped
    setup = Setup(kept_body, ImplicitVolume(), Clock(dt, 1, 1), velocity=1e-4 * shape / np.abs(shape).max())
    state, speed = setup.start(), []
    for _ in range(int(0.5 * np.pi / (swing * dt)) + 10):
        state = setup.method.advance(state, setup.boundary(0))
        speed.append(float(kept_body.mass @ (state.v * shape).sum(axis=1)))
    after = int(np.argmax(np.array(speed) < 0))
    crossed = dt * (after + speed[after - 1] / (speed[after - 1] - speed[after]))
    # Velocities of symplectic Euler belong to the middle of their step.
    assert crossed - 0.5 * dt == pytest.approx(0.5 * np.pi / swing, rel=5e-3)


@pytest.mark.parametrize("count", [0, -1, 10_000])
def test_a_count_that_no_body_has_is_refused(ball_body, count):
    with pytest.raises(MassSpringError, match="modes asked of"):
        natural_frequencies(ball_body, count)
