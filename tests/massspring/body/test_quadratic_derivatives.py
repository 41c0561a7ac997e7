"""Derivatives of quadratic bodies against central differences: volumes, forces, stiffness."""

import numpy as np
import pytest

from massspring import Body, quadratic_body
from massspring.analysis.stiffness import local_stiffness, point_hessian, spring_stiffness, stiffness_at_rest
from tests.massspring.conftest import SOFT
from tests.massspring.quadratic import MESHES, RADIUS, ball_mesh, hollow_ball, jiggled, local_force, volumes_of


@pytest.fixture(params=[*MESHES, "hollow"])
def body(request) -> Body:
    return hollow_ball() if request.param == "hollow" else quadratic_body(*MESHES[request.param](), SOFT)


def difference(function, x: np.ndarray, step: float):
    """Along a fixed direction: central difference of `function`, and the direction (3n,)."""
    along = np.random.default_rng(2).standard_normal(x.shape)
    return (function(x + step * along) - function(x - step * along)) / (2.0 * step), along.ravel()


def test_the_gradient_of_the_volumes_is_their_difference(body):
    x, volumes = jiggled(body), volumes_of(body)
    slope, along = difference(volumes.measure, x, 1e-4 * RADIUS)
    derivative = volumes.jacobian(x) @ along
    assert np.allclose(derivative, slope, rtol=0, atol=1e-6 * np.abs(slope).max())


def test_every_entry_of_the_gradient_is_that_of_its_node():
    """Column by column on one element: no corner takes the place of another."""
    points, cells = ball_mesh(0)
    body = quadratic_body(points, cells, SOFT)
    x, volumes = jiggled(body), volumes_of(body)
    dense, step = volumes.jacobian(x).toarray(), 1e-4 * RADIUS
    for i in range(3 * body.node_count):
        move = np.zeros(x.size)
        move[i] = step
        move = move.reshape(x.shape)
        slope = (volumes.measure(x + move) - volumes.measure(x - move)) / (2.0 * step)
        assert np.allclose(dense[:, i], slope, rtol=0, atol=1e-6 * np.abs(dense).max())


def test_forces_are_the_gradient_of_the_energy(body):
    """½ k d² + ½ b w (J − 1)² − Σ lam V, with a pressure that differs from volume to volume."""
    x, volumes = jiggled(body), volumes_of(body)
    lam = 500.0 + 300.0 * np.random.default_rng(4).standard_normal(volumes.count)

    def energy(x):
        d = x[body.springs.ends[:, 1]] - x[body.springs.ends[:, 0]]
        taut = 0.5 * (body.springs.stiffness * (d * d).sum(axis=1)).sum()
        return np.array([taut + body.local_energy(x) - lam @ volumes.measure(x)])

    slope, along = difference(energy, x, 1e-5 * RADIUS)
    force = -(spring_stiffness(body, x) @ x.ravel()) + local_force(body, x) + volumes.jacobian(x).T @ lam
    assert force @ along == pytest.approx(-slope[0], abs=1e-8 * float(np.abs(force) @ np.abs(along)))


def test_point_hessian_is_the_difference_of_the_gradient(body):
    x, volumes = jiggled(body), volumes_of(body)
    pressure = np.random.default_rng(6).standard_normal(volumes.weight.shape)

    def gradient(x):
        push = np.zeros_like(x)
        np.add.at(push, volumes.cells, np.einsum("kq,kqai->kai", pressure, volumes.areas(x)))
        return push.ravel()

    slope, along = difference(gradient, x, 1e-4 * RADIUS)
    hessian = point_hessian(volumes, x, pressure)
    assert np.allclose(hessian @ along, slope, rtol=0, atol=1e-6 * np.abs(slope).max())
    assert abs(hessian - hessian.T).max() <= 1e-14 * abs(hessian).max()


def test_local_stiffness_is_the_difference_of_the_local_force(body):
    """At rest, where J = 1: the first derivative is all there is."""
    slope, along = difference(lambda x: local_force(body, x), body.rest, 1e-4 * RADIUS)
    stiffness = local_stiffness(volumes_of(body), body.local_bulk, body.rest)
    assert np.allclose(stiffness @ along, -slope, rtol=0, atol=1e-5 * np.abs(slope).max())


def test_the_stiffness_at_rest_is_that_of_all_forces(body):
    volumes = volumes_of(body)
    solid = np.where(np.arange(volumes.count) < volumes.vertex_count, body.rest_pressure, 0.0)

    def force(x):
        return -(spring_stiffness(body, x) @ x.ravel()) + local_force(body, x) + volumes.jacobian(x).T @ solid

    slope, along = difference(force, body.rest, 1e-4 * RADIUS)
    stiffness = stiffness_at_rest(body)
    assert np.allclose(stiffness @ along, -slope, rtol=0, atol=1e-5 * np.abs(slope).max())
    spin = np.cross([0.3, -0.5, 0.8], body.rest).ravel()
    assert np.abs(stiffness @ spin).max() < 1e-10 * abs(stiffness).max() * np.abs(spin).max()
