"""Closed forms and converged tables with which the solver is compared (docs/theory.md, section 6). SI units
throughout."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.optimize import root_scalar
from scipy.special import spherical_jn

BALL_BETWEEN_PLANES = {
    0.05: (0.06463, 1.00446),
    0.10: (0.19197, 1.01325),
    0.15: (0.37058, 1.02550),
    0.20: (0.60204, 1.04117),
    0.25: (0.89384, 1.06043),
    0.30: (1.25968, 1.08359),
    0.35: (1.72174, 1.11112),
}
"""Incompressible neo-Hookean ball of radius R between frictionless planes, mesh-converged axisymmetric P2/P1: approach
over 2R -> (force / (mu R²), equator radius / R); two meshes agree to 1e-4."""


def principal_stress(material: Any, stretches: Sequence[float], axis: int):
    """Nominal stress [Pa] along `axis` of a body stretched by three principal stretches, p = kappa (J - 1).

    P_i = m1 J^-2/3 (s_i - I1 / 3 s_i) + m2 J^-4/3 (s_i (I1 - s_i²) - 2 I2 / 3 s_i) + kappa (J - 1) J / s_i.
    """
    m1, m2, kappa = material.parameters
    squares, s, J = np.square(stretches), stretches[axis], np.prod(stretches)
    I1, I2 = squares.sum(), 0.5 * (squares.sum() ** 2 - np.square(squares).sum())
    first = m1 * J ** (-2.0 / 3.0) * (s - I1 / (3.0 * s))
    second = m2 * J ** (-4.0 / 3.0) * (s * (I1 - s**2) - 2.0 * I2 / (3.0 * s))
    return first + second + kappa * (J - 1.0) * J / s


def uniaxial_lateral_stretch(material: Any, stretch: float):
    """Lateral stretch of the nearly incompressible block with free sides: root of the lateral stress near s^-1/2."""
    near, tight = (0.7 * stretch**-0.5, 1.3 * stretch**-0.5), {"xtol": 1e-15, "rtol": 1e-15}
    return root_scalar(lambda b: float(principal_stress(material, (b, b, stretch), 0)), bracket=near, **tight).root


def uniaxial_stress(material: Any, stretch: float):
    """Nominal axial stress [Pa] of the nearly incompressible block with free sides."""
    b = uniaxial_lateral_stretch(material, stretch)
    return principal_stress(material, (b, b, stretch), 2)


THICK_CYLINDER = {0.49: 5.0399e-3, 0.499: 5.0602e-3, 0.4999: 5.0623e-3}
"""Poisson's ratio -> displacement [m] of the inner radius of MacNeal and Harder's thick cylinder in plane strain: radii
3 and 9 m, E = 1000 Pa, inner pressure 1 Pa (Finite Elements in Analysis and Design 1, 1985)."""

COOK = {"corner u_x": -5.821, "corner u_y": 6.923, "mid-edge u_y": 6.951}
"""Displacements [mm] of Cook's membrane, finite strain, incompressible neo-Hookean in plane strain, mu = 80.1938 MPa,
100 N of shear on each mm of thickness: upper right corner, and middle of the loaded edge."""


def thick_cylinder_displacement(ratio: float, inner: float = 3.0, outer: float = 9.0, young: float = 1000.0):
    """Displacement [m] of the inner radius under unit pressure in plane strain (Lamé):
    (1 + nu) a ((1 - 2 nu) a² + b²) / (E (b² - a²))."""
    squares = (1.0 - 2.0 * ratio) * inner**2 + outer**2
    return (1.0 + ratio) * inner * squares / (young * (outer**2 - inner**2))


def thick_sphere_pressure(mu: float, inner: float, outer: float, inner_stretch: float):
    """Pressure [Pa] inside an incompressible thick sphere of rest radii inner, outer [m], inner radius stretched."""
    outer_stretch = np.cbrt(1.0 + (inner / outer) ** 3 * (inner_stretch**3 - 1.0))

    def branch(s: float):
        return 4.0 / s + s**-4.0

    return 0.5 * mu * (branch(outer_stretch) - branch(inner_stretch))


def hertz_plane_force(mu: float, radius: float, share: float):
    """Small-approach force [N] of an incompressible ball between two planes, share = approach / 2R: 4/3 E* R² d^1.5,
    E* = 4 mu."""
    return 16.0 / 3.0 * mu * radius**2 * share**1.5


def ball_torsional(n: int = 2):
    """Lowest omega R / sqrt(mu/rho) of a free ball that twists about its centre, any Poisson ratio:
    (n - 1) j_n(y) = y j_{n+1}(y) (Lamb 1882, vibrations of the first class)."""
    return first_root(lambda y: (n - 1) * spherical_jn(n, y) - y * spherical_jn(n + 1, y))


def ball_spheroidal(poisson: float, n: int = 2):
    """Lowest omega R / sqrt(mu/rho) of a free ball that changes its shape, n >= 2; poisson = 0.5 is incompressible.

    Traction-free surface of shear (y) and compression (x) waves (Lamb 1882, vibrations of the second class).
    """
    slowness = np.sqrt((1.0 - 2.0 * poisson) / (2.0 * (1.0 - poisson)))

    def traction(y: float):
        x = slowness * y
        # j_{n+1}(x) x / j_n(x), which vanishes for an incompressible body
        ratio = x * spherical_jn(n + 1, x) / spherical_jn(n, x) if x > 0.0 else 0.0
        shear, next_shear = spherical_jn(n, y), y * spherical_jn(n + 1, y)
        normal = (n * n - n - 0.5 * y * y + 2.0 * ratio) * ((n * n - 1 - 0.5 * y * y) * shear + next_shear)
        return normal - n * (n + 1) * ((n - 1) * shear - next_shear) * (n - 1 - ratio)

    return first_root(traction)


def first_root(function: Callable[[float], float], low: float = 0.5, high: float = 10.0):
    """Least root in low..high; the frequencies of a ball are more than the 0.05 of this scan apart."""
    grid = np.arange(low, high, 0.05)
    signs = np.sign([function(y) for y in grid])
    k = int(np.flatnonzero(signs[1:] != signs[:-1])[0])
    return float(root_scalar(function, bracket=(grid[k], grid[k + 1])).root)
