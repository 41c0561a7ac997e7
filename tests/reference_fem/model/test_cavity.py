"""Hollow bodies: the lumen's volume and its derivatives, and the pressure of a thick sphere filled by volume."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import MeshTet

from reference_fem import (
    Cavity,
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    SolveError,
    equilibrium_path,
    exact,
)
from reference_fem.statics.tangent import Tangent
from reference_fem.system.saddle_point import System
from reference_fem.system.state import Loads
from tests.reference_fem.bodies import shell_octant, symmetry

TISSUE = NeoHookean(1.0, 5000.0)
INNER = 0.5
STEP = 1e-6
"""Central differences: truncation about STEP² and round-off about 1e-16 / STEP, both near 1e-10 of the values."""


def inside(radius):
    """Facets whose three vertices are on a sphere: their centroid lies a little below it."""
    return lambda x: np.linalg.norm(x, axis=0) < 1.05 * radius


def filled_octant(columns=4, layers=3, inner=INNER, **content):
    return Problem(
        shell_octant(inner, columns, layers), TISSUE, symmetry(), cavities=[Cavity(inside(inner), **content)]
    )


def hollow_cube(cells=3):
    """A cube of side 1 m around an empty middle cell, held at the bottom: a closed lumen of 1/27 m³."""
    ticks = np.linspace(0.0, 1.0, cells + 1)
    mesh = MeshTet.init_tensor(ticks, ticks, ticks)
    middle = np.all(np.abs(mesh.p[:, mesh.t].mean(axis=1) - 0.5) < 0.5 / cells, axis=0)
    return mesh.restrict(np.flatnonzero(~middle))


def in_the_middle(x):
    return np.all(np.abs(x - 0.5) < 0.25, axis=0)


def closed_problem(**content):
    return Problem(
        hollow_cube(),
        TISSUE,
        [PrescribedDisplacement(lambda x: x[2] < 1e-9)],
        cavities=[Cavity(in_the_middle, **content)],
    )


def test_volume_of_an_octant_counts_the_part_inside_the_symmetry_planes():
    """Six-node facets on the sphere leave 0.11 % of its volume at this size; straight ones would leave 5 %."""
    system = System(filled_octant(), NewtonSettings())
    assert system.lumens[0].volume0 == pytest.approx(np.pi / 6.0 * INNER**3, rel=2e-3)


def test_symmetry_planes_feel_the_whole_pressure_of_the_content():
    """Each plane pulls with p times the quarter circle that the lumen shows it, a² pi / 4, of an octant V = a³ pi / 6.
    The derivative of the cone's volume has a third of it there. What is left is that of the mesh: 0.5, 0.15 %."""
    off = []
    for columns, layers in ((4, 3), (6, 4)):
        state = equilibrium_path(filled_octant(columns, layers, volume=lambda t: 1.0 + t), [1.0])[-1]
        force = state.cavity_pressure[0] * np.pi / 4.0 * (6.0 / np.pi * state.cavity_volume[0]) ** (2.0 / 3.0)
        off.append(np.abs(np.diag(state.held_force) / -force - 1.0).max())
    assert off[0] < 1e-2 and off[1] < 0.5 * off[0]


@pytest.fixture(scope="module")
def pressed():
    """A system with a pressurised lumen, a rough deformed state, and a direction."""
    system = System(closed_problem(), NewtonSettings())
    rng = np.random.default_rng(4)
    x = rng.standard_normal(system.total)
    x[: system.displacement_count] *= 0.004
    x[system.pattern.held] = 0.0
    x[-1] = 3.0
    assert system.evaluate(x, loads(system)).usable
    return system, x, rng.standard_normal(system.total)


def loads(system):
    return Loads(0.0, system.rows, system.rest().multiplier, system.filling_at(0.0, 1.0))


def test_gradient_of_the_volume(pressed):
    system, x, direction = pressed
    volumes = [system.evaluate(x + s * direction, loads(system), tangent=False).volumes[0] for s in (STEP, -STEP)]
    slope = system.evaluate(x, loads(system)).gradients[0] @ direction[: system.field_count]
    assert slope == pytest.approx((volumes[0] - volumes[1]) / (2 * STEP), rel=1e-7)


def test_a_closed_lumen_feels_no_rigid_motion(pressed):
    system, x, _ = pressed
    gradient = system.evaluate(x, loads(system)).gradients[0][: system.displacement_count].reshape(-1, 3)
    y = system.nodes + x[: system.displacement_count].reshape(-1, 3)
    assert np.abs(gradient.sum(axis=0)).max() < 1e-13
    assert np.abs(np.cross(y, gradient).sum(axis=0)).max() < 1e-13


def test_follower_stiffness_is_the_derivative_of_the_pressure_force(pressed):
    """The whole tangent with lumen pressure minus that without, against differences of p dV/dx."""
    system, x, direction = pressed
    free, d = system.pattern.free, direction.copy()
    d[system.pattern.held], d[system.field_count :] = 0.0, 0.0
    empty = x.copy()
    empty[-1] = 0.0
    upper = system.pattern.upper(
        system.evaluate(x, loads(system)).values - system.evaluate(empty, loads(system)).values
    )
    product = upper @ d[free] + upper.T @ d[free] - upper.diagonal() * d[free]
    ahead, behind = (system.evaluate(x + s * d, loads(system)).gradients[0][free] for s in (STEP, -STEP))
    expected = -x[-1] * (ahead - behind) / (2 * STEP)
    np.testing.assert_allclose(product, expected, rtol=0.0, atol=1e-7 * np.abs(expected).max())


def test_direction_solves_the_bordered_system(pressed):
    """Residual and lumen volume at x + s d vanish to first order in s: (1 - s) of the residual is left."""
    system, x, _ = pressed
    evaluation = system.evaluate(x, loads(system))
    d = Tangent(system, evaluation).newton(0.0 * x[system.pattern.held])
    ahead, behind = (system.evaluate(x + s * d, loads(system)).residual for s in (STEP, -STEP))
    slope = (ahead - behind) / (2 * STEP)
    rows = np.append(system.pattern.free, system.field_count)
    np.testing.assert_allclose(
        slope[rows], -evaluation.residual[rows], rtol=0.0, atol=1e-6 * np.abs(evaluation.residual).max()
    )


def test_pressure_of_a_thick_sphere_filled_by_volume():
    """Oracle 2, within 0.2 %: this mesh leaves 0.08 %, ten columns and six layers 0.009 %."""
    stretches = np.array([1.1, 1.25, 1.5])
    problem = filled_octant(6, 4, volume=lambda t: t**3)
    path = equilibrium_path(problem, stretches, NewtonSettings(start=1.0))
    for stretch, state in zip(stretches, path, strict=True):
        expected = exact.thick_sphere_pressure(1.0, INNER, 1.0, stretch)
        assert state.cavity_pressure[0] == pytest.approx(expected, rel=2e-3)
        assert state.cavity_volume[0] == pytest.approx(path[0].cavity_volume[0] * (stretch / 1.1) ** 3, rel=1e-7)


def test_filling_goes_past_the_pressure_maximum():
    """A thin wall: the closed form has its maximum near a stretch of 1.4, where a prescribed pressure stops."""
    stretches = np.array([1.2, 1.4, 1.7, 2.0])
    problem = filled_octant(4, 1, inner=0.8, volume=lambda t: t**3)
    path = equilibrium_path(problem, stretches, NewtonSettings(start=1.0))
    pressures = [state.cavity_pressure[0] for state in path]
    expected = [exact.thick_sphere_pressure(1.0, 0.8, 1.0, stretch) for stretch in stretches]
    assert max(expected) > expected[-1]
    np.testing.assert_allclose(pressures, expected, rtol=0.015)  # one layer leaves 0.2 to 0.9 %, more as the wall thins


def test_a_prescribed_pressure_gives_the_volume_of_the_closed_form():
    pressure = exact.thick_sphere_pressure(1.0, INNER, 1.0, 1.25)
    state = equilibrium_path(filled_octant(pressure=lambda t: pressure * t), [1.0])[0]
    assert state.cavity_pressure[0] == pytest.approx(pressure, rel=1e-12)
    assert np.cbrt(state.cavity_volume[0] / (np.pi / 6.0 * INNER**3)) == pytest.approx(1.25, rel=5e-3)


def test_incompressible_content_stiffens_a_squeezed_body():
    """A lid pressed onto the hollow cube: the full lumen keeps its volume and pushes back, the open one collapses."""
    lid = PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9, (0, 1, 2), lambda t: (0.0, 0.0, -0.1 * t))
    full = closed_problem()
    full = replace(full, held=[*full.held, lid])
    closed, vented = (equilibrium_path(p, [1.0])[0] for p in (full, replace(full, cavities=())))
    assert closed.cavity_volume[0] == pytest.approx(1.0 / 27.0, rel=1e-8)
    assert closed.cavity_pressure[0] > 0.1
    assert closed.held_force[1, 2] < 1.02 * vented.held_force[1, 2] < 0.0
    assert vented.cavity_pressure.shape == (0,)


def test_what_is_inside_at_the_start_is_switched_on_first():
    """A constant pressure, and gravity with it: the same state as when they grow with time."""
    problem = replace(closed_problem(pressure=lambda t: 0.3), density=0.1, gravity=(0.0, 0.0, -1.0))
    at_once = equilibrium_path(problem, [0.0])[0]
    grown = equilibrium_path(replace(problem, cavities=[Cavity(in_the_middle, pressure=lambda t: 0.3 * t)]), [1.0])[0]
    assert at_once.cavity_pressure[0] == pytest.approx(0.3, rel=1e-12)
    np.testing.assert_allclose(at_once.u, grown.u, atol=1e-6)


@pytest.mark.parametrize(
    ("cavity", "words"),
    [
        (Cavity(lambda x: x[0] > 7.0), "contains none of the"),
        (Cavity(lambda x: ~in_the_middle(x)), "encloses -1 m³"),
        (Cavity(lambda x: in_the_middle(x) & (x[2] < 0.5)), "is open along"),
        (Cavity(in_the_middle, volume=lambda t: 0.0), "filling of cavity 0 is 0.0"),
        (Cavity(in_the_middle, volume=lambda t: 1 + t, pressure=lambda t: t), "both a volume and a pressure"),
        (Cavity(in_the_middle, pressure=lambda t: np.nan), "pressure of cavity 0 is nan"),
    ],
)
def test_bad_cavities(cavity, words):
    with pytest.raises(SolveError, match=words) as caught:
        equilibrium_path(replace(closed_problem(), cavities=[cavity]), [1.0])
    assert "\n" not in str(caught.value)


def test_two_cavities_cannot_share_a_wall():
    with pytest.raises(SolveError, match="share 12 facets"):
        System(replace(closed_problem(), cavities=[Cavity(in_the_middle), Cavity(in_the_middle)]), NewtonSettings())


def test_two_lumens_have_their_own_pressures():
    """Two cells of a bar, squeezed more on one side: each keeps its volume."""
    mesh = MeshTet.init_tensor(np.arange(6.0), np.arange(4.0), np.arange(4.0))
    centre = mesh.p[:, mesh.t].mean(axis=1)

    def cell(first):
        return lambda x: (np.abs(x - np.array([[first], [1.5], [1.5]])) < 0.51).all(axis=0)

    mesh = mesh.restrict(np.flatnonzero(~(cell(1.5)(centre) | cell(3.5)(centre))))
    tilted = PrescribedDisplacement(
        lambda x: x[2] > 3 - 1e-9, (2,), lambda t: (0.0, 0.0, t), lambda x: -0.06 * np.tile(x[0], (3, 1))
    )
    problem = Problem(
        mesh,
        TISSUE,
        [PrescribedDisplacement(lambda x: x[2] < 1e-9), tilted],
        cavities=[Cavity(cell(1.5)), Cavity(cell(3.5))],
    )
    state = equilibrium_path(problem, [1.0])[0]
    np.testing.assert_allclose(state.cavity_volume, 1.0, rtol=1e-7)
    assert state.cavity_pressure[1] > 1.5 * state.cavity_pressure[0] > 0.0
