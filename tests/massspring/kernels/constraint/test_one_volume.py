"""HCJ05 with one volume: its residual, its multiplier by another solve, and what must not change it."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Attachment, Clock, ImplicitVolume, Setup
from massspring.kernels.arrays.layout import Push
from massspring.kernels.constraint.one_volume import volume_multiplier
from massspring.kernels.forces.volume import enclosed_volume, volume_gradient_into
from massspring.kernels.step.begin import open_frame
from massspring.kernels.step.end import advance
from massspring.layout.allocate import start
from massspring.layout.state import new_diagnostics
from tests.massspring.conftest import activate
from tests.massspring.methods.test_methods import clock_for, thrown


def test_the_one_step_residual_is_exact(body):
    """V after a step is V0 + ½ Δxᵀ H Δx + V[Δx], that is V0 + Σ x·g(Δx) + V[Δx]: second order in this step only."""
    setup = Setup(body, ImplicitVolume(), clock_for(body, 1, 1), velocity=thrown(body))
    state = setup.start()
    for _ in range(5):  # the residual of earlier steps must not appear
        before = state.x
        state = setup.method.advance(state, setup.boundary(0))
        step = state.x - before
        gradient = np.empty_like(step)
        cubic = volume_gradient_into(step, body.triangles, gradient)
        expected = body.volume + float((before * gradient).sum()) + cubic
        assert enclosed_volume(state.x, body.triangles) == pytest.approx(expected, rel=1e-12)
        assert abs(expected / body.volume - 1) > 1e-9, "the residual is too small to be seen"


def held_and_touched(net, nodes, contacts, touched, approach):
    """Rows of constraints on single velocities and their right sides: `approach` at touched nodes, v* at held ones."""
    rows, right = [], []
    for i, a in zip(touched, approach, strict=True):
        rows.append(np.zeros_like(nodes.x))
        rows[-1][i] = contacts.normal[i]
        right.append(a)
    for i in net.held_nodes:
        for axis in range(3):
            rows.append(np.zeros_like(nodes.x))
            rows[-1][i, axis] = 1.0
            right.append(nodes.v_star[i, axis])
    return [row.ravel() for row in rows], right


def test_the_multiplier_equals_the_full_saddle_point_solve(ball_body):
    """Outside truth: [M/dt², −Gᵀ; G, 0] with held nodes and touched nodes as further constraints, solved densely."""
    body = ball_body
    rng = np.random.default_rng(0)
    state = start(body, (Attachment(np.array([5, 17])),), v=0.1 * rng.normal(size=body.rest.shape))
    net, nodes, contacts, dt = state.model, state.nodes, state.contacts, 1e-3
    nodes.v_star[:] = state.v
    nodes.v_star[net.held_nodes] = [0.02, 0.0, -0.01]
    touched = np.array([40, 41, 90])
    approach = activate(contacts, touched, rng)
    target = 1.02 * body.volume
    error = target - volume_gradient_into(nodes.x, net.triangles, nodes.gradient)
    lam, _ = volume_multiplier(nodes, contacts, net.inverse_mass, error, dt)

    n = 3 * body.node_count
    rows, right = held_and_touched(net, nodes, contacts, touched, approach)
    constraints, right = np.array([dt * nodes.gradient.ravel(), *rows]), [error, *right]
    mass = np.repeat(body.mass, 3)
    system = np.block([[np.diag(mass), -constraints.T], [constraints, np.zeros((len(right), len(right)))]])
    solution = np.linalg.solve(system, np.concatenate([mass * nodes.v_star.ravel(), right]))
    assert lam == pytest.approx(solution[n], rel=1e-9)  # the row is dt G, so its multiplier is the pressure

    x = nodes.x.copy()
    boundary = Setup(body, ImplicitVolume(), Clock(dt, 1, 1)).boundary(0)
    frame = replace(state, diagnostics=new_diagnostics(1, 1)).frame(boundary)
    open_frame(frame)
    advance(frame, Push(nodes.gradient, lam))
    assert np.allclose(nodes.v.ravel(), solution[:n], atol=1e-12)
    assert np.allclose(nodes.x, x + dt * nodes.v)


def test_a_body_without_a_volume_gradient_is_counted_not_crashed(ball_body):
    setup = Setup(ball_body, ImplicitVolume(), clock_for(ball_body, 1, 1))
    state = setup.start()
    state.nodes.x[:] = np.outer(np.linspace(0, 0.1, ball_body.node_count), [1.0, 0.0, 0.0])
    after = setup.method.advance(state, setup.boundary(0))
    assert after.diagnostics.singular[0] == 1
    assert after.lam == 0.0 and np.isfinite(after.x).all()
