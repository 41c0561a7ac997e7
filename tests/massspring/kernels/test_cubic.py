"""The volume along a line is a cubic: its coefficients, and its root of smallest modulus."""

import numpy as np
import pytest

from massspring.kernels.constraint.exact_volume import nearest_root, volume_cubic
from massspring.kernels.forces.volume import enclosed_volume, volume_gradient_into


def gradient(x, triangles):
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
    volume, slope = gradient(y, body.triangles)
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
