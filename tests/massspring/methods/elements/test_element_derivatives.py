"""Energy, forces and stiffness of implicit elements: against the definition and against central differences."""

import numpy as np
import pytest

from massspring import Attachment, Clock, ImplicitElements, Plane, Setup
from massspring.kernels.forces.elements import add_element_stiffness, element_energy, element_forces_into
from massspring.kernels.forces.springs import spring_energy, spring_forces_into
from massspring.methods.elements.newton import NewtonStep
from massspring.methods.elements.tangent import elements_of, target_ratios
from tests.massspring.quadratic import (
    MU,
    curved_solid,
    deformation,
    energy_without_volume,
    jiggled,
    linear_solid,
    mixed_solid,
)

BULK = 20.0 * MU


@pytest.fixture(scope="module", params=["linear", "quadratic", "mixed"])
def solid(request):
    if request.param == "linear":
        return linear_solid()
    return (curved_solid if request.param == "quadratic" else mixed_solid)(contact="nodes")


@pytest.fixture
def elements(solid):
    """With targets that differ from volume to volume."""
    filling = 1.0 + 0.1 * np.random.default_rng(0).standard_normal(solid.kept.count)
    return elements_of(solid, BULK)._replace(target_ratio=target_ratios(solid, filling))


def energy(body, elements, x):
    springs = body.springs
    return spring_energy(x, springs.ends, springs.rest_length, springs.stiffness) + element_energy(elements, x)


def force(body, elements, x):
    springs, pull, push = body.springs, np.empty_like(x), np.empty_like(x)
    spring_forces_into(x, springs.ends, springs.rest_length, springs.stiffness, pull)
    element_forces_into(elements, x, push)
    return pull + push


def test_the_energy_is_that_of_its_definition(solid, elements):
    """Springs and elements together, above what they are at rest."""
    x = jiggled(solid)
    f, weight = deformation(solid, x)
    own = 0.5 * BULK * float(weight @ (np.linalg.det(f) - elements.target_ratio.ravel()) ** 2)
    rest = 0.5 * BULK * float(weight @ (1.0 - elements.target_ratio.ravel()) ** 2)
    above = energy(solid, elements, x) - energy(solid, elements, solid.rest)
    assert above == pytest.approx(energy_without_volume(solid, x) + own - rest, rel=1e-9)


def test_forces_are_minus_the_gradient_of_the_energy(solid, elements):
    x, along, step = jiggled(solid), np.random.default_rng(1).standard_normal(solid.rest.shape), 1e-6 * solid.size
    after, before = (energy(solid, elements, x + s * along) for s in (step, -step))
    slope = float((force(solid, elements, x) * along).sum())
    assert slope == pytest.approx((before - after) / (2 * step), rel=1e-6)


def test_rest_is_balanced(solid):
    elements = elements_of(solid, BULK)
    pull = np.abs(force(solid, elements._replace(constants=np.zeros(3)), solid.rest)).max()
    assert np.abs(force(solid, elements, solid.rest)).max() < 1e-12 * pull


@pytest.fixture
def held(solid):
    """A state with some nodes held, its step in the making at jiggled positions."""
    setup = Setup(solid, ImplicitElements(20.0), Clock(0.02, 1, 1), (), (Attachment(np.array([0, 4, 7])),), damping=3.0)
    return setup.start(), setup.boundary(0)


def matrix_at(state, boundary, x, exact=True):
    """T in the numbers of all free nodes, dense, and those nodes."""
    prepared, pattern = state.memory, state.memory.pattern
    data = prepared.constant(state, boundary).copy()
    add_element_stiffness(prepared.elements, pattern.places, x, boundary.dt**2, exact, data)
    size = 3 * len(pattern.free)
    dense = np.zeros((size, size))
    rows = np.repeat(np.arange(size), np.diff(pattern.indptr))
    dense[rows, pattern.indices] = data
    return dense, pattern.free


def test_the_stiffness_is_the_derivative_of_the_imbalance(solid, held):
    """Every column, with held nodes left out; symmetric to the last bit."""
    state, boundary = held
    x, step = jiggled(solid), NewtonStep(state, boundary, 0)
    dense, free = matrix_at(state, boundary, x)
    assert np.abs(dense - dense.T).max() < 1e-14 * dense.max() and len(free) == solid.node_count - 3
    for k in np.random.default_rng(3).choice(3 * len(free), 40, replace=False):
        move = np.zeros_like(x)
        move[free[k // 3], k % 3] = 1e-6 * solid.size
        sides = []
        for sign in (1, -1):
            step.p = x + sign * move
            sides.append(step.imbalance()[free].ravel())
        slope = (sides[1] - sides[0]) / (2e-6 * solid.size)
        assert np.abs(dense[:, k] - slope).max() < 1e-6 * np.abs(dense).max()


def test_the_imbalance_is_minus_the_slope_of_the_potential(solid, held):
    state, boundary = held
    step, x = NewtonStep(state, boundary._replace(gravity=np.array([1.0, -2.0, 3.0])), 0), jiggled(solid)
    along = np.random.default_rng(4).standard_normal(x.shape)
    along[step.model.held_nodes] = 0.0
    size = 1e-6 * solid.size
    after, before = (step.potential(x + s * along)[0] for s in (size, -size))
    step.p = x
    assert float((step.imbalance() * along).sum()) == pytest.approx((before - after) / (2 * size), rel=1e-6)


def test_without_what_the_pressure_turns_the_stiffness_is_positive(solid, held):
    """Pressed to a third: the exact one is not, in steps so long that inertia does not help."""
    state, boundary = held
    x, boundary = solid.rest * np.array([1.0, 1.0, 0.33]), boundary._replace(dt=10.0)
    values = [np.linalg.eigvalsh(matrix_at(state, boundary, x, exact)[0])[0] for exact in (True, False)]
    assert values[0] < 0.0 < values[1]


def test_the_factor_solves_and_its_columns_are_its_answers(solid, held):
    state, boundary = held
    step = NewtonStep(state, boundary, 0)
    step.p = jiggled(solid)
    tangent, (dense, free) = step.tangent(True), matrix_at(state, boundary, step.p)
    forces = np.random.default_rng(6).standard_normal(step.p.shape)
    answer = tangent.respond(forces)
    assert np.allclose(dense @ answer[free].ravel(), forces[free].ravel(), atol=1e-9 * np.abs(forces).max())
    assert not answer[step.model.held_nodes].any()
    nodes, directions = free[[3, 9, 3]], np.eye(3)[[0, 2, 1]]
    for k, column in enumerate(tangent.columns(nodes, directions)):
        unit = np.zeros_like(forces)
        unit[nodes[k]] = directions[k]
        assert np.allclose(column, tangent.respond(unit), rtol=0, atol=1e-12 * np.abs(column).max())


def test_a_pass_past_obstacles_is_that_of_the_saddle_point_system(solid, held):
    """Outside truth: [T, −Cᵀ; C, 0] solved densely, with nodes on a plane that has come into the body."""
    low = float(solid.rest[:, 2].min())
    floor = Plane((0, 0, low - 1e-6), (0, 0, 1))
    setup = Setup(solid, ImplicitElements(20.0), Clock(0.02, 1, 1), (floor,), gravity=(0.0, 0.0, -9.81))
    state, boundary = setup.start(), setup.boundary(0)
    step = NewtonStep(state, boundary, 0)
    step.right = step.imbalance()
    change, rows, impulses, agreed = step.newton_pass()
    assert agreed and len(rows.nodes) > 2
    dense, free = matrix_at(state, boundary, step.p)
    rank, size = step.prepared.pattern.rank, 3 * len(free)
    c = np.zeros((len(rows.nodes), size))
    for row, (node, direction) in enumerate(zip(rows.nodes, rows.direction, strict=True)):
        c[row, 3 * rank[node] : 3 * rank[node] + 3] = direction
    system = np.block([[dense, -c.T], [c, np.zeros((len(c), len(c)))]])
    right = np.concatenate([step.right[free].ravel(), rows.place - rows.along(step.p)])
    exact = np.linalg.solve(system, right)
    assert np.allclose(change[free].ravel(), exact[:size], rtol=0, atol=1e-9 * np.abs(exact[:size]).max())
    assert np.allclose(impulses, exact[size:], rtol=1e-7, atol=1e-9 * np.abs(impulses).max())
