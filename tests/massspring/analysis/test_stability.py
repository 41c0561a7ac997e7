"""Natural frequencies, the limit that the largest sets, and what a run does on either side of it."""

from dataclasses import replace
from time import sleep

import numpy as np
import pytest
from scipy.linalg import eigh, null_space
from scipy.sparse import block_array, csr_array, diags_array, eye_array
from scipy.sparse.linalg import eigsh

from massspring import (
    Body,
    Clock,
    Free,
    ImplicitVolume,
    MassSpringError,
    Setup,
    StepLimit,
    make_clock,
    quadratic_body,
    simulate,
    step_limit,
)
from massspring.analysis.stability import largest_frequency, scaled_stiffness, slowest_frequency
from massspring.analysis.stiffness import stiffness_at_rest
from massspring.body.springs import Springs
from tests.massspring.conftest import SOFT, body_of
from tests.massspring.kernels.forces.test_forces import forces
from tests.massspring.methods.test_methods import thrown
from tests.massspring.quadratic import quadratic_block
from tests.massspring.rows import CONTESTANTS, rows

SOFTNESS = 1e-10
"""Relative compliance added to the kept volumes, so that the system is regular even if some depend on others."""


def natural_frequencies(body: Body, count: int, keep: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """The `count` lowest ω [1/s], ascending, (count,), and their modes (count, n, 3) with Σ m |u|² = 1 kg m² (eq. 5.5).

    K u − Jᵀ p = ω² M u with J u = 0 for the volumes that are kept; `keep` False: springs alone. Six frequencies of a
    free body are 0.
    """
    n = 3 * body.node_count
    stiffness = stiffness_at_rest(body)
    mass = diags_array(np.repeat(body.moved_mass, 3))
    level = float(stiffness.diagonal().mean())
    if keep:
        gradients = body.kept.jacobian(body.rest)
        gradients = gradients * (level / np.abs(gradients.data).mean())
        m = body.kept.count
        stiffness = block_array([[stiffness, gradients.T], [gradients, -SOFTNESS * level * eye_array(m)]])
        mass = block_array([[mass, None], [None, csr_array((m, m))]])
    # Below all frequencies, near the lowest: that of a shear wave across the body.
    shift = -level / float(body.moved_mass.mean()) * body.node_count ** (-2.0 / 3.0)
    start = np.random.default_rng(0).standard_normal(n + body.kept.count * keep)
    square, shape = eigsh(stiffness.tocsc(), count, M=mass.tocsc(), sigma=shift, v0=start)
    order = np.argsort(square)
    return np.sqrt(np.maximum(square[order], 0.0)), shape[:n, order].T.reshape(count, -1, 3)


def test_the_stiffness_matrix_is_minus_the_derivative_of_the_forces(body):
    direction = np.random.default_rng(1).uniform(-1, 1, body.rest.shape)
    step = 1e-7 * body.size
    change = (forces(body, body.rest + step * direction) - forces(body, body.rest - step * direction)) / (2 * step)
    root = np.sqrt(body.mass)[:, None]
    exact = -root * (scaled_stiffness(body, np.empty(0, int)) @ (root * direction).ravel()).reshape(-1, 3)
    assert np.abs(change - exact).max() < 1e-6 * np.abs(exact).max()


def test_the_largest_frequency_is_that_of_a_dense_solver(block_body):
    dense = scaled_stiffness(block_body, np.empty(0, int)).toarray()
    assert largest_frequency(block_body) == pytest.approx(np.sqrt(np.linalg.eigvalsh(dense)[-1]), rel=1e-4)


@pytest.mark.parametrize("held", [np.arange(4), np.array([0, 9, 17])], ids=["a few", "three"])
def test_the_smallest_frequency_is_that_of_a_dense_solver(held):
    """In the space in which the kept volumes stay; a body that nothing holds, or one node, has none."""
    body = quadratic_body(*quadratic_block(), SOFT)
    body = replace(body, inertia=body.mass * np.linspace(1.0, 9.0, body.node_count))
    free = np.delete(np.arange(3 * body.node_count).reshape(-1, 3), held, axis=0).ravel()
    keeping = null_space(body.kept.jacobian(body.rest)[:, free].toarray())
    stiffness = keeping.T @ stiffness_at_rest(body)[free][:, free].toarray() @ keeping
    mass = keeping.T @ np.diag(np.repeat(body.moved_mass, 3)[free]) @ keeping
    exact = np.sqrt(eigh(stiffness, mass, eigvals_only=True)[0])
    assert slowest_frequency(body, held) == pytest.approx(exact, rel=2e-2)
    assert slowest_frequency(body, held[:0]) == slowest_frequency(body, held[:1]) == 0.0


KEEPING_ALL_CELLS = ("xpbd", "element_hard")
"""The volumes of all cells take the stiffest modes away: such methods hold above the limit of the springs too."""
LIMITED = [name for name, method in CONTESTANTS.items() if method.capabilities.conditionally_stable]
"""Steps of 200 limits of the others are in test_implicit_springs.py."""


def stiffest_mode(body, method):
    """Of springs and what the method adds, by a dense solver, (n, 3)."""
    matrix, factor = scaled_stiffness(body, np.empty(0, int)).toarray(), method.added_stiffness(body)
    if factor is not None:
        scaled = np.repeat(1 / np.sqrt(body.mass), 3)[:, None] * factor.toarray()
        matrix = matrix + scaled @ scaled.T
    return np.linalg.eigh(matrix)[1][:, -1].reshape(-1, 3) / np.sqrt(body.mass)[:, None]


def in_the_stiffest_mode(body, method, fraction):
    """The history of 4,000 steps of `fraction` of the limit."""
    dt = fraction * step_limit(body, added=method.added_stiffness(body)).undamped
    v = 1e-6 * stiffest_mode(body, method) * np.sqrt(body.mass.min())
    return simulate(Setup(body, method, Clock(400 * dt, 10, 400), velocity=v))


@pytest.mark.parametrize("row", rows(LIMITED, ("block", "ball")))
def test_runs_stay_below_the_limit(row, request):
    """Constraints do not lower the limit (Cauchy interlacing), forces do."""
    history = in_the_stiffest_mode(body_of(row[1], request), CONTESTANTS[row[0]], 0.97)
    assert history.outcome == "finished" and history.kinetic[-1] < 100 * history.kinetic[0] + 1e-12


@pytest.mark.parametrize("row", rows([name for name in LIMITED if name not in KEEPING_ALL_CELLS], ("block", "ball")))
def test_runs_diverge_above_the_limit(row, request):
    history = in_the_stiffest_mode(body_of(row[1], request), CONTESTANTS[row[0]], 1.05)
    grown = history.outcome == "diverged" or history.kinetic[-1] > 1e4 * max(history.kinetic[0], 1e-20)
    assert grown, "a run above the limit stayed quiet"


def test_viscous_damping_lowers_the_limit_as_predicted():
    """One oscillator, v⁺ = (1 − c dt) v − ω² dt x: bounded just below the damped limit, growing just above it."""
    omega, c = 100.0, 60.0
    limit = StepLimit(omega, c)
    assert limit.damped < limit.undamped

    def swing(dt: float) -> float:
        x, v = 1.0, 0.0
        for _ in range(4000):
            v = (1 - c * dt) * v - omega**2 * dt * x
            x += dt * v
            if abs(x) > 1e6:
                break
        return abs(x)

    assert swing(0.995 * limit.damped) < 1.0
    assert swing(1.005 * limit.damped) > 1e5


def test_a_body_without_stiffness_has_no_limit(block_body):
    from dataclasses import replace

    none = Springs(np.empty((0, 2), np.uint32), np.empty(0), np.empty(0), np.empty(0, np.uint8))
    limp: Body = replace(block_body, springs=none)
    with pytest.raises(MassSpringError, match="no stiffness"):
        step_limit(limp)


def test_the_clock_fills_the_duration_with_steps_no_longer_than_asked_for():
    limit = StepLimit(1000.0, 0.0)
    clock = make_clock(1.0, 100, 0.0003, limit)
    assert clock.steps == 34 and clock.dt <= 0.0003 and clock.duration == pytest.approx(1.0)
    assert make_clock(1.0, 100, "auto", limit).dt == pytest.approx(0.001)


def test_a_step_above_the_limit_is_made_where_it_is_wanted():
    limit = StepLimit(1000.0, 0.0)
    assert make_clock(1.0, 10, 0.005, limit, beyond_limit=True).dt == pytest.approx(0.005)
    assert make_clock(1.0, 10, 0.002, limit).dt == pytest.approx(0.002)


def test_a_run_that_diverges_ends_with_nan_tails_and_says_where(ball_body):
    dt = 3 * step_limit(ball_body).undamped
    history = simulate(Setup(ball_body, Free(), Clock(50 * dt, 40, 50), velocity=thrown(ball_body)))
    assert history.outcome == "diverged" and f"frame {history.good_frames + 1}" in history.message
    assert np.isnan(history.volume[history.good_frames :]).all()
    assert np.isfinite(history.volume[: history.good_frames]).all()


def test_a_run_ends_at_its_time_limit(ball_body):
    history = simulate(Setup(ball_body, Free(), Clock(0.01, 50, 20)), time_limit=0.0)
    assert history.outcome == "timed-out" and history.good_frames == 1


def test_waiting_does_not_count_for_the_time_limit(ball_body):
    """As where several runs share a processor."""
    setup = Setup(ball_body, Free(), Clock(0.01, 5, 20))
    simulate(setup)  # compiles
    history = simulate(setup, on_frame=lambda frame: sleep(0.05), time_limit=0.1)
    assert history.outcome == "finished"


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
