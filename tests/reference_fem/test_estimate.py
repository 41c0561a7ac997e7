"""Where a solution needs smaller elements: nowhere in a homogeneous stress, first at a singular edge."""

import numpy as np
import pytest
from skfem import ElementTetP2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from reference_fem import NeoHookean, NewtonSettings, PrescribedDisplacement, Problem, equilibrium_path, nodes
from reference_fem.elements.shapes import basis_table, element_nodes
from reference_fem.estimate import stress_indicator, vertex_fit
from reference_fem.system.saddle_point import System
from tests.reference_fem.bodies import ball_octant, block

SOLID = NeoHookean(2.0, 2000.0)


def everything_held(mesh, gradient):
    """A body whose every node is at gradient · x; the unknowns of that, with a pressure of 0.3 Pa."""
    problem = Problem(mesh, SOLID, [PrescribedDisplacement(lambda x: x[2] < 1e-9)])
    system = System(problem, NewtonSettings())
    u = nodes(mesh) @ np.asarray(gradient).T
    return system, np.concatenate([u.ravel(), np.full(mesh.nvertices, 0.3)])


@pytest.mark.parametrize("mesh", [block((3, 2, 2), skew=0.05), ball_octant(3)], ids=["skew", "curved"])
def test_a_homogeneous_deformation_needs_nothing(mesh):
    system, x = everything_held(mesh, [[0.2, 0.1, 0.0], [0.0, -0.1, 0.3], [0.1, 0.0, 0.05]])
    homogeneous = stress_indicator(system, x)
    energy = SOLID.mu**2 * system.volume
    assert homogeneous.shape == (mesh.nelements,) and (homogeneous >= 0).all()
    assert homogeneous.sum() < 1e-24 * energy


def test_a_stress_that_is_linear_is_recovered():
    """Small bending: the stress grows linearly, and every element holds it."""
    mesh = block((3, 2, 2), skew=0.05)
    system, x = everything_held(mesh, np.zeros((3, 3)))
    a, b, _ = nodes(mesh).T
    size = 1e-5
    u = size * np.stack([a * b, -0.5 * a**2 - 0.5 * b**2, np.zeros(len(a))], axis=1)
    x = np.concatenate([u.ravel(), np.zeros(mesh.nvertices)])
    # The law is not linear: what is left of P is of second order in the strain.
    assert stress_indicator(system, x).sum() < 1e-6 * (SOLID.mu * size) ** 2 * system.volume
    bent = u + size * np.stack([a**3, 0 * a, 0 * a], axis=1)
    assert stress_indicator(system, np.concatenate([bent.ravel(), x[u.size :]])).sum() > 1e-4 * (SOLID.mu * size) ** 2


def test_it_grows_with_the_square_of_the_stress_and_with_volume():
    """Ten times as stiff, a hundred times the indicator; twice as long, eight times the volume."""
    indicators = {}
    for name, (stiffness, length) in {"one": (1.0, 1.0), "stiff": (10.0, 1.0), "long": (1.0, 2.0)}.items():
        mesh = block((2, 2, 2), skew=0.05).scaled(length)
        problem = Problem(mesh, NeoHookean(stiffness, 1e3 * stiffness), [PrescribedDisplacement(lambda x: x[2] < 1e-9)])
        system = System(problem, NewtonSettings())
        a, b, c = nodes(mesh).T / length
        u = 0.05 * length * np.stack([a * b * c, c**2, a**2], axis=1)
        indicators[name] = stress_indicator(
            system, np.concatenate([u.ravel(), np.full(mesh.nvertices, 0.1 * stiffness)])
        )
    np.testing.assert_allclose(indicators["stiff"], 100 * indicators["one"], rtol=1e-9)
    np.testing.assert_allclose(indicators["long"], 8 * indicators["one"], rtol=1e-9)


def test_elements_at_a_singular_edge_come_first():
    """A block glued to its support on half of its foot: the stress is infinite along the border of the glue."""
    mesh = block((6, 2, 4))
    glued = PrescribedDisplacement(lambda x: (x[2] < 1e-9) & (x[0] < 0.5 + 1e-9))
    pulled = PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9, motion=lambda t: (0.0, 0.0, t))
    problem, checkpoints = Problem(mesh, SOLID, [glued, pulled]), []
    equilibrium_path(problem, (0.05,), on_checkpoint=checkpoints.append)
    indicator = stress_indicator(System(problem, NewtonSettings()), checkpoints[-1].state.x)
    corners = mesh.p.T[mesh.t.T]
    on = (np.abs(corners[..., 0] - 0.5) < 1e-9) & (corners[..., 2] < 1e-9)
    at_edge = on.any(axis=1)
    assert 0.02 < at_edge.mean() < 0.2
    largest = np.argsort(-indicator)[: at_edge.sum() // 3]
    assert at_edge[largest].all()


def places(mesh, degree=4):
    """The quadrature points (ne, nq, 3) and their weights."""
    points, weights = get_quadrature(RefTet, degree)
    shapes, slopes = basis_table(ElementTetP2(), points)
    x = nodes(mesh)[element_nodes(mesh)]
    sizes = np.abs(np.linalg.det(np.einsum("eni,qJn->eqiJ", x, slopes)))
    return np.einsum("qn,eni->eqi", shapes, x), sizes * weights


@pytest.mark.parametrize("mesh", [block((2, 2, 3), skew=0.05), ball_octant(3)], ids=["skew", "curved"])
@pytest.mark.parametrize("scale", [1.0, 1e-6])
def test_a_linear_field_is_its_own_fit(mesh, scale):
    """Whatever the size of the body, the element's shape and the corner where only one of them is."""
    slopes = np.array([[1.0, -2.0], [0.5, 3.0], [-1.0, 0.2]])
    y, weights = places(mesh)
    y, weights, vertices = scale * y, scale**3 * weights, scale * nodes(mesh)[: mesh.nvertices]
    fitted = vertex_fit(y, weights, 4.0 + y @ slopes / scale, mesh.t[:4].T, vertices)
    np.testing.assert_allclose(fitted, 4.0 + vertices @ slopes / scale, rtol=0, atol=1e-10)
