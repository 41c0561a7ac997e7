"""Meshes, boundary facets, the order of the quadrature, dead loads, and the evaluator."""

import numpy as np
import pytest

from reference_fem import (
    BodyForce,
    Evaluator,
    NeoHookean,
    PrescribedDisplacement,
    Problem,
    SolveError,
    Traction,
    nodes,
    surface_triangles,
)
from reference_fem import equilibrium_path as solve
from reference_fem.elements.shapes import ORDER, build_elements, build_facets, facet_nodes
from reference_fem.system.assembly import deformation
from tests.reference_fem.bodies import ball_octant, block, shell_octant


def enclosed_volume(points, triangles):
    a, b, c = points[triangles].transpose(1, 0, 2)
    return np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0


def test_curved_octant_has_the_volume_and_area_of_the_ball():
    """Curved quadratic elements: O(h⁴), 1e-3 at four elements to a quarter circle where straight ones lose 3 %."""
    mesh = ball_octant(4)
    assert build_elements(mesh, 5).weights.sum() == pytest.approx(np.pi / 6, rel=1.5e-3)
    on_sphere = np.isclose(np.linalg.norm(nodes(mesh)[facet_nodes(mesh)], axis=2), 1.0).all(axis=1)
    assert build_facets(mesh, 4).weights[on_sphere].sum() == pytest.approx(np.pi / 2, rel=1.5e-3)


@pytest.mark.parametrize("mesh", [block(skew=0.1), ball_octant(3), shell_octant(0.5, 3, 2)])
def test_surface_triangles_close_the_body_and_point_outward(mesh):
    triangles = surface_triangles(mesh)
    half_edges = np.vstack([triangles[:, [i, j]] for i, j in ((0, 1), (1, 2), (2, 0))])
    there = {tuple(edge) for edge in half_edges}
    assert len(there) == len(half_edges)
    assert all((b, a) in there for a, b in there)
    volume = build_elements(mesh, 5).weights.sum()
    # flat quarters of curved facets cut off up to 4.1 % here
    assert enclosed_volume(nodes(mesh), triangles) == pytest.approx(volume, rel=0.045)


def quadratic(x):
    return np.column_stack((x[:, 0] ** 2 - x[:, 1], x[:, 1] * x[:, 2] + 1.0, 0.5 * x[:, 2] ** 2 + x[:, 0] * x[:, 1]))


def test_evaluator_is_exact_for_quadratic_fields():
    mesh = block((3, 2, 4), skew=0.05)
    points = np.random.default_rng(1).uniform(0.0, 1.0, (300, 3))
    evaluator = Evaluator(mesh)
    np.testing.assert_allclose(evaluator.displacement(quadratic(nodes(mesh)), points), quadratic(points), atol=1e-12)
    assert np.array_equal(evaluator.outside, np.zeros(300))


def test_evaluator_inverts_curved_elements():
    """The position field itself is in the span of curved elements, so it comes back exactly."""
    mesh = ball_octant(3)
    rng = np.random.default_rng(2)
    points = np.abs(rng.standard_normal((300, 3)))
    points *= rng.uniform(0.2, 0.99, 300)[:, None] / np.linalg.norm(points, axis=1)[:, None]
    evaluator = Evaluator(mesh)
    np.testing.assert_allclose(evaluator.displacement(nodes(mesh), points), points, atol=1e-10)
    assert evaluator.outside.max() < 1e-6


def test_evaluator_gives_nodal_values_at_nodes():
    mesh = ball_octant(3)
    u = np.random.default_rng(3).standard_normal(nodes(mesh).shape)
    np.testing.assert_allclose(Evaluator(mesh).displacement(u, nodes(mesh)), u, atol=1e-8)


def test_evaluator_extrapolates_near_the_surface_and_says_how_far():
    mesh = block()
    evaluator = Evaluator(mesh)
    points = np.array([[1.02, 0.3, 0.4], [0.5, 0.5, 0.5]])
    np.testing.assert_allclose(evaluator.displacement(quadratic(nodes(mesh)), points), quadratic(points), atol=1e-12)
    assert evaluator.outside[1] == 0.0
    # along the axes of a right-angled element, at most sqrt(3) longer than the true 0.02
    assert 0.02 - 1e-12 <= evaluator.outside[0] <= 0.02 * 3**0.5


@pytest.mark.parametrize(
    ("points", "words"), [([[3.0, 0, 0]], "outside the mesh"), ([[np.nan, 0, 0]], "finite"), ([[1, 2]], "shape")]
)
def test_evaluator_refuses_points_it_cannot_serve(points, words):
    with pytest.raises(SolveError, match=words):
        Evaluator(block()).displacement(np.zeros_like(nodes(block())), points)


SOFT = NeoHookean(1.0, 1000.0)
BOTTOM = PrescribedDisplacement(lambda x: x[2] < 1e-9)
PUSH = np.array([0.03, -0.02, 0.05])


def everywhere(value):
    """The same vector at every point, growing with time."""
    return lambda t, x: t * np.repeat(np.asarray(value)[:, None], x.shape[1], axis=1)


@pytest.mark.parametrize(
    ("load", "total"),
    [(BodyForce(everywhere(PUSH)), PUSH), (Traction(lambda x: x[2] > 1 - 1e-9, everywhere(PUSH)), PUSH)],
    ids=["body force", "traction"],
)
def test_holders_carry_a_dead_load(load, total):
    """On the unit cube a force per volume and a force per area of the lid have the same resultant."""
    state = solve(Problem(block(skew=0.1), SOFT, [BOTTOM], loads=[load]), [1.0])[0]
    np.testing.assert_allclose(state.held_force[0], -total, atol=1e-6)


def test_gravity_is_a_body_force():
    """The same equilibrium, to the Newton tolerance: gravity is on from the start, the load arrives with time."""
    mesh, pull = block(), np.array([0.0, 0.0, -0.1])
    heavy = solve(Problem(mesh, SOFT, [BOTTOM], gravity=pull / 2.0, density=2.0), [1.0])[0]
    loaded = solve(Problem(mesh, SOFT, [BOTTOM], loads=[BodyForce(everywhere(pull))]), [1.0])[0]
    np.testing.assert_allclose(heavy.u, loaded.u, atol=1e-7)


@pytest.mark.parametrize(
    ("load", "words"),
    [
        (Traction(lambda x: x[0] > 9.0, everywhere(PUSH)), "acts on no facet"),
        (BodyForce(lambda t, x: np.full_like(x, np.nan)), "finite values of shape"),
        (BodyForce(lambda t, x: x[0]), "finite values of shape"),
    ],
)
def test_bad_loads_are_refused(load, words):
    with pytest.raises(SolveError, match=words):
        solve(Problem(block(), SOFT, [BOTTOM], loads=[load]), [1.0])


@pytest.mark.parametrize(("order", "exact"), [(ORDER, True), (2, False)])
def test_the_default_order_integrates_p_times_J_exactly(order, exact):
    """J is a cubic in a quadratic u, p J a quartic: against order 7, to round-off.

    Order 2 is half a percent off here, but it converges as fast: no oracle would see it.
    """

    def integral(order):
        elements = build_elements(mesh, order)
        F, p = deformation(x, elements)
        return np.sum(elements.weights * p * np.linalg.det(F))

    mesh = block(skew=0.1)
    x = 0.05 * np.random.default_rng(6).standard_normal(3 * len(nodes(mesh)) + mesh.nvertices)
    assert bool(abs(integral(order) / integral(7) - 1.0) < 1e-11) is exact
