"""Walls of triangle springs against the membrane they stand for."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import (
    Body,
    Clock,
    Free,
    ImplicitVolume,
    MassSpringError,
    Ramp,
    Setup,
    membrane_body,
    simulate,
    step_limit,
)
from massspring.analysis.stability import scaled_stiffness
from massspring.analysis.stiffness import membrane_stiffness
from massspring.body.membranes import lloyd_springs, triangle_springs
from massspring.kernels.arrays.layout import Membrane
from massspring.kernels.forces.springs import add_membrane_forces, membrane_energy
from tests.massspring.conftest import SOFT, icosphere
from tests.massspring.kernels.forces.test_forces import directional

THICKNESS = 0.002  # m
MU = SOFT.shear_modulus


@pytest.fixture(scope="module")
def balloon() -> Body:
    """162 nodes, 2 mm of tissue round water."""
    return membrane_body(*icosphere(2), THICKNESS, SOFT, content=1000.0)


def shaken(points: np.ndarray, by: float = 0.004) -> np.ndarray:
    """Positions moved by up to a quarter of an edge."""
    return points + by * np.random.default_rng(3).uniform(-1, 1, points.shape)


def force(x: np.ndarray, membrane: Membrane) -> np.ndarray:
    out = np.zeros_like(x)
    add_membrane_forces(x, membrane, out)
    return out


def membrane_by_definition(
    rest: np.ndarray, x: np.ndarray, triangles: np.ndarray, shear: float, poisson: float
) -> float:
    """Outside truth: Σ A h [lambda/2 (tr E)² + G E:E], E = (FᵀF − I)/2 from a frame in each triangle."""
    lame = 2 * shear * poisson / (1 - poisson)
    total = 0.0
    for nodes in triangles:
        here, there = (p[nodes[1:]] - p[nodes[0]] for p in (rest, x))
        normal = np.cross(*here)
        first = here[0] / np.linalg.norm(here[0])
        frame = np.array([first, np.cross(normal / np.linalg.norm(normal), first)])
        f = np.linalg.solve(here @ frame.T, there)  # rows: derivatives along the frame
        strain = (f @ f.T - np.eye(2)) / 2
        area = 0.5 * np.linalg.norm(normal)
        total += area * THICKNESS * (lame / 2 * np.trace(strain) ** 2 + shear * (strain**2).sum())
    return total


@pytest.mark.parametrize("poisson", [0.0, 1 / 3, 0.5])
def test_triangle_springs_store_the_energy_of_a_stvk_membrane(poisson):
    """Delingette's claim, at strains of up to one half: to round-off."""
    points, triangles = icosphere(1)
    rest = shaken(points)
    membrane = triangle_springs(rest, triangles, THICKNESS, MU, poisson)
    x = shaken(1.3 * points[:, [1, 2, 0]], by=0.01)
    exact = membrane_by_definition(rest, x, triangles, MU, poisson)
    assert membrane_energy(x, membrane) == pytest.approx(exact, rel=1e-12)


def test_their_forces_are_minus_the_derivative_of_their_energy(balloon):
    x = shaken(balloon.rest)
    direction = np.random.default_rng(5).uniform(-1, 1, x.shape)
    exact = -float((force(x, balloon.membrane) * direction).sum())
    assert directional(lambda y: membrane_energy(y, balloon.membrane), x, direction) == pytest.approx(exact, rel=1e-7)


def test_their_stiffness_is_the_derivative_of_their_forces(balloon):
    direction = np.random.default_rng(1).uniform(-1, 1, balloon.rest.shape)
    step = 1e-7 * balloon.size
    ahead, behind = (force(balloon.rest + sign * step * direction, balloon.membrane) for sign in (1, -1))
    exact = -(membrane_stiffness(balloon) @ direction.ravel()).reshape(-1, 3)
    assert np.abs((ahead - behind) / (2 * step) - exact).max() < 1e-6 * np.abs(exact).max()
    none = np.empty(0, dtype=np.int64)
    assert np.linalg.norm(scaled_stiffness(balloon, none).toarray()) > 0


@pytest.mark.parametrize("law", ["delingette", "lloyd"])
def test_a_filled_balloon_presses_as_the_closed_form_says(law):
    """Blown up by s = 1.1: U = A h (lambda + G) (s² − 1)²/2 with lambda = 2 G, p = dU/dV = 2 G A h (s² − 1)/(s V0).

    Lloyd's springs of E = 3 mu, Poisson ratio ⅓, pull with E/(1 − ⅓) (s − 1) in every direction. Facets and the unequal
    triangles of the polyhedron move both by less than 1 %.
    """
    body = membrane_body(*icosphere(2), THICKNESS, SOFT, law=law)
    stretch = 1.1
    dt = 0.4 * step_limit(body, 30.0).damped
    clock = Clock(20 * dt, 100, 20)
    ramp = Ramp((0.0, 0.5 * clock.duration), (1.0, stretch**3))
    history = simulate(Setup(body, ImplicitVolume(), clock, damping=30.0, targets={"whole": ramp}))
    corners = body.rest[body.triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    if law == "delingette":
        pressure = 2 * MU * area * THICKNESS * (stretch**2 - 1) / (stretch * body.volume)
    else:
        tension = 3 * MU * THICKNESS / (1 - 1 / 3) * (stretch - 1) / stretch  # per deformed length
        pressure = 2 * tension / (3 * body.volume / area * stretch)
    assert history.pressure[-1, 0] == pytest.approx(pressure, rel=0.01)
    assert history.volume[-1, 0] == pytest.approx(stretch**3 * body.volume, rel=1e-5)


def test_lloyd_is_exact_for_equilateral_triangles_at_a_third():
    """Small strain of a flat sheet: ½ A h [E/(1 − ν²)] (ex² + ey² + 2 ν ex ey + (1 − ν)/2 g²), ν = ⅓, in its middle."""
    size, young = 9, 3 * MU
    grid = np.array([(i + 0.5 * j, np.sqrt(0.75) * j, 0.0) for j in range(size) for i in range(size)])
    at = np.arange(size * size).reshape(size, size)
    low, right, up, corner = (g.ravel() for g in (at[:-1, :-1], at[:-1, 1:], at[1:, :-1], at[1:, 1:]))
    triangles = np.vstack([np.column_stack([low, right, up]), np.column_stack([right, corner, up])])
    springs = lloyd_springs(grid, triangles, THICKNESS, young)
    area = len(triangles) * np.sqrt(3) / 4
    for ex, ey, shear in ((1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 0, 1), (0.5, -0.3, 0.7)):
        f = np.eye(3) + 1e-6 * np.array([[ex, shear / 2, 0], [shear / 2, ey, 0], [0, 0, 0]])
        length = np.linalg.norm((grid[springs.ends[:, 1]] - grid[springs.ends[:, 0]]) @ f.T, axis=1)
        stored = 0.5 * float(springs.stiffness @ (length - springs.rest_length) ** 2)
        sheet = 0.5 * area * THICKNESS * young / (1 - 1 / 9) * 1e-12
        assert stored == pytest.approx(sheet * (ex**2 + ey**2 + 2 / 3 * ex * ey + shear**2 / 3), rel=1e-5)


def test_the_mass_is_wall_and_content(balloon):
    corners = balloon.rest[balloon.triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    assert balloon.mass.sum() == pytest.approx(SOFT.density * THICKNESS * area + 1000.0 * balloon.volume, rel=1e-12)


@pytest.mark.parametrize("method", [Free(), ImplicitVolume()], ids=["free", "implicit_volume"])
def test_every_loop_feels_them(balloon, method):
    """The first step from a shaken state changes momentum by dt f: without the wall's forces nothing would move."""
    dt = 0.1 * step_limit(balloon).undamped
    bare = replace(balloon, membrane=balloon.membrane._replace(triangles=balloon.membrane.triangles[:0]))
    ends = []
    for body in (balloon, bare):
        setup = Setup(body, method, Clock(dt, 1, 1))
        state = setup.start()
        state.nodes.x[:] = shaken(balloon.rest)
        ends.append(method.advance(state, setup.boundary(0)))
    felt = balloon.mass[:, None] * (ends[0].v - ends[1].v)
    wall = dt * force(shaken(balloon.rest), balloon.membrane)
    if isinstance(method, Free):
        assert np.abs(felt - wall).max() < 1e-12 * np.abs(wall).max()
    else:
        assert np.linalg.norm(felt - wall) < np.linalg.norm(wall)  # the pressure takes a part


def test_bad_walls_are_refused(balloon):
    points, triangles = icosphere(1)
    broken = balloon.membrane.stiffness.copy()
    broken[4] = np.nan
    with pytest.raises(MassSpringError, match="triangle springs hold 3 values that are not finite"):
        replace(balloon, membrane=balloon.membrane._replace(stiffness=broken))
    with pytest.raises(MassSpringError, match="a triangle spring names node 261"):
        replace(balloon, membrane=balloon.membrane._replace(triangles=balloon.membrane.triangles + 100))
    flat = points.copy()
    flat[triangles[0, 2]] = 0.5 * (flat[triangles[0, 0]] + flat[triangles[0, 1]])
    with pytest.raises(MassSpringError, match="of the wall has no area"):
        triangle_springs(flat, triangles, THICKNESS, MU)
