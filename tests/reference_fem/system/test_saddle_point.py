"""Energy -> residual -> tangent by finite differences, for elements and contact, and mutants that must fail."""

import numpy as np
import pytest

from reference_fem import (
    MooneyRivlin,
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    RigidPlane,
    RigidSphere,
    curve,
)
from reference_fem.contact import augmented as contact
from reference_fem.system import assembly
from reference_fem.system.saddle_point import System
from reference_fem.system.state import Loads
from tests.reference_fem.bodies import block, contact_potential

STEP = 1e-6
"""Central differences: truncation about STEP² and round-off about 1e-16 / STEP, both near 1e-10 of the values."""
AGREES = 1e-7
"""A hundred times the error of the differences; a wrong factor or sign shows at 1e-2 or more."""


MATERIALS = {"neo-Hookean": NeoHookean(2.0, 50.0), "Mooney-Rivlin": MooneyRivlin(0.4, 0.6, 50.0)}


def bumpy():
    """A cube whose top is domed: curved elements of unequal shape."""

    def dome(x):
        return x + np.array([[0.0], [0.0], [0.1]]) * np.sin(np.pi * x[0]) * np.sin(np.pi * x[1])

    return curve(block((2, 2, 2), skew=0.1), dome, lambda x: x[2] > 1 - 1e-9)


BLOCKS = [("u", "p"), ("p", "p"), ("u", "u")]
"""Rows and columns."""


@pytest.fixture(scope="module", params=MATERIALS)
def system(request):
    obstacles = [RigidPlane((0.0, 0.0, 1.2), (0.1, 0.0, -1.0)), RigidSphere((1.55, 0.5, 0.5), 0.55)]
    held = [PrescribedDisplacement(lambda x: x[2] < 1e-9)]
    problem = Problem(bumpy(), MATERIALS[request.param], held, obstacles)
    return System(problem, NewtonSettings(penalty=20.0))


@pytest.fixture(scope="module")
def state(system):
    """A deformed state, a direction with held unknowns too, and multipliers that keep every contact point pressed."""
    rng = np.random.default_rng(0)
    x, direction = np.zeros(system.total), rng.standard_normal(system.total)
    x[: system.displacement_count] = 0.01 * rng.standard_normal(system.displacement_count)
    x[system.displacement_count :] = rng.standard_normal(system.total - system.displacement_count)
    multiplier = 300.0 + rng.uniform(0.0, 1.0, system.rest().multiplier.shape)
    return x, direction, Loads(0.0, system.rows, multiplier)


def potential(system, x, loads):
    touch = contact.touch(loads.rows, np.zeros((2, 3)), loads.multiplier, system.surface.penalty)
    own = assembly.energy(x, system.elements, system.problem.material)
    return own + contact_potential(x, system.surface, touch)


def whole_product(system, values, direction):
    """Tangent times direction, in the free rows."""
    free, held = direction[system.pattern.free], direction[system.pattern.held]
    upper = system.pattern.upper(values)
    return upper @ free + upper.T @ free - upper.diagonal() * free + system.pattern.lifting(values) @ held


def tangent_misfit(system, state, values):
    """Largest relative error of the force rows and of the volume rows."""
    x, direction, loads = state
    after = system.evaluate(x + STEP * direction, loads, tangent=False).residual
    before = system.evaluate(x - STEP * direction, loads, tangent=False).residual
    expected = ((after - before) / (2 * STEP))[system.pattern.free]
    gap = np.abs(whole_product(system, values, direction) - expected)
    pressure = system.pattern.free >= system.displacement_count
    return max(gap[rows].max() / np.abs(expected[rows]).max() for rows in (pressure, ~pressure) if rows.any())


def test_residual_is_the_gradient_of_the_potential(system, state):
    x, direction, loads = state
    evaluation = system.evaluate(x, loads)
    assert (evaluation.touch.pressure > 0).all()
    slope = (potential(system, x + STEP * direction, loads) - potential(system, x - STEP * direction, loads)) / (
        2 * STEP
    )
    assert evaluation.residual @ direction == pytest.approx(slope, rel=AGREES)


def test_tangent_is_the_gradient_of_the_residual(system, state):
    x, _, loads = state
    assert tangent_misfit(system, state, system.evaluate(x, loads).values) < AGREES


@pytest.mark.parametrize(("rows", "columns"), BLOCKS)
def test_a_wrong_factor_on_any_block_is_noticed(system, state, rows, columns):
    x, _, loads = state
    values = system.evaluate(x, loads).values
    upper, kind = system.pattern.upper(values).tocoo(), np.array(["u", "p"])
    is_pressure = (system.pattern.free >= system.displacement_count).astype(int)
    wrong = (kind[is_pressure[upper.row]] == rows) & (kind[is_pressure[upper.col]] == columns)
    assert wrong.any()
    values[: len(upper.data)][wrong] *= 1.01
    assert tangent_misfit(system, state, values) > 10 * AGREES


def test_predictor_linearises_the_move_of_the_obstacles(system, state):
    x, _, loads = state
    move = np.random.default_rng(1).standard_normal(loads.rows[:, 1:4].shape)

    def residual(step):
        rows = loads.rows.copy()
        rows[:, 1:4] += step * move
        return system.evaluate(x, loads._replace(rows=rows), tangent=False).residual

    lifted = system.evaluate(x, loads._replace(shift=move), tangent=False).residual - residual(0.0)
    expected = (residual(STEP) - residual(-STEP)) / (2 * STEP)
    np.testing.assert_allclose(lifted, expected, rtol=0.0, atol=AGREES * np.abs(expected).max())


def test_an_inverted_element_stops_the_kernel(system, state):
    x, _, loads = state
    flat = x.copy()
    flat[0 : system.displacement_count : 3] = -2.0 * system.nodes[:, 0]
    evaluation = system.evaluate(flat, loads)
    assert evaluation.smallest_J < 0.0
    assert not evaluation.usable


def test_two_evaluations_are_bitwise_equal(system, state):
    x, _, loads = state
    first, second = system.evaluate(x, loads), system.evaluate(x, loads)
    assert np.array_equal(first.values, second.values)
    assert np.array_equal(first.residual, second.residual)
