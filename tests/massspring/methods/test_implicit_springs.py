"""Implicit springs: against dense solves, against explicit steps, and at steps that explicit ones cannot take."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import (
    Attachment,
    Body,
    Clock,
    ImplicitSprings,
    ImplicitVolume,
    MassSpringError,
    Setup,
    Volumes,
    membrane_body,
    simulate,
    step_limit,
    tetrahedral_body,
)
from massspring.kernels.contact.modes import ON_EDGE, SLIDES, STICKS
from massspring.methods.implicit.contact import ActiveSet
from massspring.methods.implicit.factor import Factor
from tests.massspring.conftest import SOFT, block, icosphere
from tests.massspring.methods.test_methods import squeeze, thrown

LONG = 20.0
"""Steps in explicit limits 2/ω_max."""


def limit(body: Body) -> float:
    return step_limit(body).undamped


@pytest.fixture
def started(block_body):
    """A state with two held nodes, and its factor."""
    state = ImplicitSprings().start(block_body, (Attachment(np.array([0, 1])),))
    dt = LONG * limit(block_body)
    return state, Factor(state.model, dt, 3.0), dt


def dense(model, dt: float, damping: float) -> np.ndarray:
    """A by its definition, springs one by one, held nodes without response."""
    matrix = np.diag((1 + damping * dt) * model.mass)
    for (i, j), k in zip(model.ends.astype(int), model.stiffness, strict=True):
        matrix[[i, j], [i, j]] += dt * dt * k
        matrix[[i, j], [j, i]] -= dt * dt * k
    inverse = np.zeros_like(matrix)
    free = np.flatnonzero(model.inverse_mass)
    inverse[np.ix_(free, free)] = np.linalg.inv(matrix[np.ix_(free, free)])
    return inverse


def test_the_factor_is_that_of_the_matrix(started):
    state, factor, dt = started
    inverse = dense(state.model, dt, 3.0)
    forces = np.random.default_rng(0).normal(size=(len(inverse), 3))
    assert np.allclose(factor.respond(forces), inverse @ forces, rtol=1e-10, atol=1e-12 * np.abs(inverse).max())
    nodes = np.array([4, 7, 4])
    assert np.allclose(factor.columns(nodes).T, inverse[:, nodes], rtol=1e-10, atol=1e-12 * np.abs(inverse).max())


def test_the_response_past_obstacles_is_that_of_the_saddle_point_system(started):
    """Outside truth: [A, −Cᵀ; C, 0] solved densely, for nodes that slide, stick and lie in a wedge."""
    state, factor, dt = started
    nodes, contacts, rng = state.nodes, state.contacts, np.random.default_rng(1)
    for name in ("normal", "second_normal"):
        vectors = rng.normal(size=nodes.x.shape)
        getattr(contacts, name)[:] = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    contacts.mode[[3, 5, 8, 20]] = [SLIDES, STICKS, ON_EDGE, SLIDES]
    contacts.contact_id[[3, 5, 8, 20]], contacts.second[8] = 1, 2
    contacts.v_target[:] = rng.normal(size=nodes.x.shape)
    active = ActiveSet(factor, nodes, contacts, np.arange(len(nodes.x), dtype=np.uint32), dt)
    assert len(active.nodes) == 1 + 3 + 2 + 1 and sorted(set(active.obstacle)) == [0, 1]
    rows = np.zeros((len(active.nodes), nodes.x.size))
    for row, node, direction in zip(rows, active.nodes, active.direction, strict=True):
        row[3 * node : 3 * node + 3] = direction
    inverse = np.kron(dense(state.model, dt, 3.0), np.eye(3))
    forces = rng.normal(size=nodes.x.shape)
    base = inverse @ forces.ravel()
    gamma = np.linalg.solve(rows @ inverse @ rows.T, -rows @ base)
    exact = (base + inverse @ rows.T @ gamma).reshape(-1, 3)
    assert np.allclose(active.without(factor.respond(forces)), exact, atol=1e-10 * np.abs(exact).max())
    assert np.abs(active.along(exact)).max() < 1e-10 * np.abs(exact).max()


def test_short_steps_agree_with_explicit_ones(kept_body):
    """Both are of first order, from opposite sides: at 1/16 and 1/32 of the limit they close in on each other."""
    v, duration = 0.2 * thrown(kept_body), 4 * limit(kept_body)
    apart = []
    for steps in (64, 128):
        ends = [
            simulate(Setup(kept_body, m, Clock(duration, 1, steps), gravity=(0, 0, -9.81), velocity=v)).final
            for m in (ImplicitSprings(), ImplicitVolume())
        ]
        apart.append(np.abs(ends[1] - ends[0]).max())
    moved = np.abs(ends[0] - kept_body.rest).max()
    assert apart[1] < 0.02 * moved
    assert apart[1] == pytest.approx(0.5 * apart[0], rel=0.2)


@pytest.mark.parametrize("law", ["van_gelder", "cotangent"])
def test_twenty_times_the_explicit_limit_is_stable_and_ends_in_the_same_balance(law):
    """Pressed between planes and held: force, shape and pressure of the explicit method's end."""
    body = tetrahedral_body(*block((3, 3, 2)), SOFT, law)
    if law == "cotangent":
        body = body.keeping(Volumes.nodal(body))
    ends = []
    for method, dt in ((ImplicitVolume(), 0.5 * limit(body)), (ImplicitSprings(), LONG * limit(body))):
        steps = int(np.ceil(5.0 / dt))
        setup = Setup(body, method, Clock(5.0 / steps, steps, 1), squeeze(body, 0.004, 2.0), damping=5.0)
        ends.append(simulate(setup))
    explicit, implicit = ends
    assert implicit.outcome == "finished" and implicit.min_j[-1] > 0
    assert np.abs(implicit.contact_force[-1, :, 2] / explicit.contact_force[-1, :, 2] - 1).max() < 0.005
    assert implicit.pressure[-1].mean() == pytest.approx(explicit.pressure[-1].mean(), rel=0.01)
    assert implicit.penetration.max() < 1e-12 * body.size
    assert np.abs(implicit.volume / implicit.volume_target - 1).max() < 1e-4


@pytest.mark.parametrize("factor", [1.0, 1e4])
def test_no_step_and_no_stiffness_is_too_long(ball_body, factor):
    """Thrown with a spin, at 200 times the explicit limit: many passes lose energy alone, few stay bounded.

    A hundred passes end within 0.05 % of the converged step.
    """
    body = ball_body.stiffened(factor)
    dt, v = 200 * limit(body), 0.05 * thrown(body)
    at_first = 0.5 * float(body.mass @ (v**2).sum(axis=1))
    for passes, most in ((100, 1.001), (ImplicitSprings.passes, 3.0)):
        history = simulate(Setup(body, ImplicitSprings(passes=passes), Clock(dt, 40, 1), velocity=v))
        total = history.kinetic + history.elastic
        assert history.outcome == "finished"
        assert total.max() < most * at_first
        assert total[-1] < min(at_first, total[20])


def test_momentum_is_kept_at_long_steps_too(kept_body):
    v = 0.1 * thrown(kept_body)
    setup = Setup(kept_body, ImplicitSprings(), Clock(LONG * limit(kept_body), 1, 1), velocity=v)
    after = setup.method.advance(setup.start(), setup.boundary(0))
    mass = kept_body.mass[:, None]
    assert np.abs((mass * (after.v - v)).sum(axis=0)).max() < 1e-12 * np.abs(mass * v).sum()


def test_what_is_held_and_what_it_takes(block_body):
    """A hanging block: the attachment carries the weight, whatever the step."""
    top = np.flatnonzero(block_body.rest[:, 2] > block_body.rest[:, 2].max() - 0.005)
    dt = LONG * limit(block_body)
    setup = Setup(
        block_body,
        ImplicitSprings(),
        Clock(dt, 200, 1),
        attachments=(Attachment(top),),
        gravity=(0.0, 0.0, -9.81),
        damping=2.0,
    )
    history = simulate(setup)
    assert history.held_force[-1, 0, 2] == pytest.approx(9.81 * block_body.mass.sum(), rel=1e-6)
    assert np.array_equal(history.final[top], block_body.rest[top])


def test_targets_that_grow_are_followed(ball_body):
    from massspring import Ramp

    ramp = Ramp((0.0, 1.0), (1.0, 1.3))
    history = simulate(Setup(ball_body, ImplicitSprings(), Clock(0.05, 30, 1), damping=5.0, targets={"whole": ramp}))
    assert history.volume[-1, 0] == pytest.approx(1.3 * ball_body.volume, rel=1e-6)
    assert history.pressure[-1, 0] > 0


def test_the_step_may_be_longer_than_the_time_in_which_damping_acts(ball_body):
    """Damping is implicit too: a body at 5 m/s loses 1 + c dt of its speed in each step, whatever c dt is."""
    v = np.tile([5.0, 0.0, 0.0], (ball_body.node_count, 1))
    setup = Setup(ball_body, ImplicitSprings(), Clock(0.1, 1, 1), damping=30.0, velocity=v)
    after = setup.method.advance(setup.start(), setup.boundary(0))
    assert np.allclose(after.v, v / 4.0, rtol=0, atol=1e-9)


def test_what_it_cannot_do_is_refused():
    wall = membrane_body(*icosphere(1), 0.002, SOFT)
    with pytest.raises(MassSpringError, match="supports no triangle springs, they harden without bound"):
        Setup(wall, ImplicitSprings(), Clock(0.01, 1, 1))


def test_a_collapsed_body_has_nothing_to_push_on(ball_body):
    setup = Setup(ball_body, ImplicitSprings(passes=1), Clock(1e-3, 1, 1))
    state = setup.start()
    state.nodes.x[:] = np.outer(np.linspace(0, 0.1, ball_body.node_count), [1.0, 0.0, 0.0])
    after = setup.method.advance(state, setup.boundary(0))
    assert after.diagnostics.singular[0] == 1 and np.isfinite(after.x).all()


def test_a_state_can_be_advanced_twice(block_body):
    """The cache of responses that a state carries changes no answer."""
    setup = Setup(block_body, ImplicitSprings(), Clock(0.01, 1, 2), squeeze(block_body, 0.004, 0.01))
    state = setup.start()
    first, second = (setup.method.advance(state, setup.boundary(0)) for _ in range(2))
    assert np.array_equal(first.x, second.x)
    assert np.array_equal(replace(state).x, block_body.rest)
