"""Every derivative against finite differences, every identity of docs/theory.md, section 2; cubics along a line."""

import numpy as np
import pytest

from massspring import Body
from massspring.kernels.constraint.exact_volume import nearest_root, volume_cubic
from massspring.kernels.forces.springs import spring_energy, spring_forces_into
from massspring.kernels.forces.volume import (
    enclosed_volume,
    smallest_ratio,
    tetrahedron_volumes_into,
    volume_gradient_into,
)

ROUND_OFF = 1e-13  # relative; sums of a few thousand doubles
STEP = 1e-6  # relative central differences: error ~ 1e-12 truncation + 1e-10 round-off
DIFFERENCE = 1e-8


def moved(body: Body, seed: int = 3, by: float = 0.2) -> np.ndarray:
    """Positions away from rest, by a fraction of the mean spring length."""
    amount = by * body.springs.rest_length.mean()
    return body.rest + amount * np.random.default_rng(seed).uniform(-1, 1, body.rest.shape)


def gradient(body: Body, x: np.ndarray) -> np.ndarray:
    g = np.empty_like(x)
    volume_gradient_into(x, body.triangles, g)
    return g


def forces(body: Body, x: np.ndarray) -> np.ndarray:
    f = np.empty_like(x)
    spring_forces_into(x, body.springs.ends, body.springs.rest_length, body.springs.stiffness, f)
    return f


def energy(body: Body, x: np.ndarray) -> float:
    return spring_energy(x, body.springs.ends, body.springs.rest_length, body.springs.stiffness)


def directional(function, x: np.ndarray, direction: np.ndarray) -> float:
    """Central difference along a direction of unit maximum norm."""
    step = STEP * np.abs(x).max()
    return (function(x + step * direction) - function(x - step * direction)) / (2 * step)


@pytest.fixture
def direction(body: Body) -> np.ndarray:
    return np.random.default_rng(5).uniform(-1, 1, body.rest.shape)


def test_the_volume_gradient_is_the_derivative_of_the_volume(body, direction):
    x = moved(body)
    exact = float((gradient(body, x) * direction).sum())
    assert directional(lambda y: enclosed_volume(y, body.triangles), x, direction) == pytest.approx(
        exact, rel=DIFFERENCE
    )
    # The mutant this must catch: the tetrahedron gradient without its 1/6.
    assert directional(lambda y: enclosed_volume(y, body.triangles), x, direction) != pytest.approx(6 * exact, rel=0.1)


def test_spring_forces_are_minus_the_derivative_of_the_energy(body, direction):
    x = moved(body)
    exact = -float((forces(body, x) * direction).sum())
    assert directional(lambda y: energy(body, y), x, direction) == pytest.approx(exact, rel=DIFFERENCE)


def test_spring_forces_are_internal(body):
    x = moved(body)
    f = forces(body, x)
    scale = np.abs(f).sum()
    assert np.abs(f.sum(axis=0)).max() < ROUND_OFF * scale
    assert np.abs(np.cross(x, f).sum(axis=0)).max() < ROUND_OFF * scale


def test_springs_at_rest_pull_with_nothing(body):
    assert np.abs(forces(body, body.rest)).max() < 1e-12 * body.springs.stiffness.max() * body.size


def test_a_collapsed_spring_gives_no_nan(body):
    x = body.rest.copy()
    x[body.springs.ends[0, 1]] = x[body.springs.ends[0, 0]]
    assert np.isfinite(forces(body, x)).all()


@pytest.mark.parametrize("far", [0.0, 1e3])
def test_identities_of_the_volume_gradient(body, far):
    """Σ G = 0, Σ x × G = 0, Σ x·G = 3 V; 1,000 m from the origin as well, less the digits of the positions."""
    x = moved(body) + far
    g, volume = gradient(body, x), enclosed_volume(x, body.triangles)
    scale = np.abs(g).sum() * body.size
    lost = ROUND_OFF + np.finfo(float).eps * far / body.size
    assert np.abs(g.sum(axis=0)).max() < lost * scale / body.size
    centred = x - x.mean(axis=0)
    assert np.abs(np.cross(centred, g).sum(axis=0)).max() < 10 * lost * scale
    assert float((centred * g).sum()) == pytest.approx(3 * volume, rel=100 * lost)


def test_the_ball_has_the_volume_of_its_polyhedron(ball_body):
    """Outside truth: a sum of signed tetrahedra by determinants; and the sphere from below."""
    x = ball_body.rest
    determinants = np.linalg.det(x[ball_body.triangles]).sum() / 6
    assert ball_body.volume == pytest.approx(determinants, rel=1e-12)
    assert 0.93 < ball_body.volume / (4 / 3 * np.pi * 0.05**3) < 1


def test_tetrahedron_volumes_add_up_and_turn_negative_when_turned_over(block_body):
    volumes = block_body.tetrahedron_volumes
    assert volumes.sum() == pytest.approx(block_body.volume, rel=ROUND_OFF)
    mirrored = block_body.rest * np.array([-1.0, 1.0, 1.0])
    after = np.empty_like(volumes)
    tetrahedron_volumes_into(mirrored, block_body.tetrahedra, after)
    assert smallest_ratio(after, volumes) == pytest.approx(-1.0, rel=1e-12)


def volume_and_gradient(x, triangles):
    """(V, G)."""
    out = np.empty_like(x)
    return volume_gradient_into(x, triangles, out), out


def test_the_volume_along_a_line_is_the_cubic(body):
    rng = np.random.default_rng(3)
    y = body.rest + 0.1 * body.size * rng.normal(size=body.rest.shape) + 5.0
    d = rng.normal(size=y.shape)
    coefficients = volume_cubic(y, d, body.triangles)
    for a in (-0.7, 0.01, 0.4, 2.0):
        expected = enclosed_volume(y + a * d, body.triangles)
        terms = [k * a**power for power, k in enumerate(coefficients)]
        assert sum(terms) == pytest.approx(expected, abs=1e-12 * np.abs(terms).sum())
    volume, slope = volume_and_gradient(y, body.triangles)
    assert coefficients[0] == pytest.approx(volume, rel=1e-12)
    assert coefficients[1] == pytest.approx((slope * d).sum(), rel=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_the_nearest_root_is_that_of_a_general_solver(seed):
    """numpy's eigenvalue solver as the other code; magnitudes over six decades."""
    rng = np.random.default_rng(seed)
    for _ in range(200):
        k = rng.normal(size=4) * 10.0 ** rng.uniform(-3, 3, size=4)
        roots = np.roots(k[::-1])
        real = roots[np.abs(roots.imag) < 1e-9 * np.abs(roots)].real
        truth = real[np.argmin(np.abs(real))]
        assert nearest_root(*k) == pytest.approx(truth, rel=1e-7)


def test_roots_at_the_edge():
    assert nearest_root(0.0, 1.0, 2.0, 3.0) == 0.0
    assert nearest_root(-2.0, 4.0, 0.0, 0.0) == 0.5
    assert nearest_root(-8.0, 0.0, 0.0, 1.0) == pytest.approx(2.0, rel=1e-14)
    assert nearest_root(-6.0, 11.0, -6.0, 1.0) == pytest.approx(1.0, rel=1e-13)  # of 1, 2, 3
    near, two = 0.5 * 0.5005, 0.5 + 0.5005  # of 0.5, 0.5005, 0.7: a pair on the edge between one real root and three
    assert nearest_root(-0.7 * near, near + 0.7 * two, -0.7 - two, 1.0) == pytest.approx(0.5, rel=1e-9)
    assert nearest_root(1e-9, -1.0, 0.5, 2.0) == pytest.approx(1e-9, rel=1e-8)
    assert np.isnan(nearest_root(1.0, 0.0, 0.0, 0.0))
    assert np.isnan(nearest_root(1.0, 0.0, 1.0, 0.0))
