"""Quadratic bodies: constant springs and volumes over points, against closed forms and differences of the energy."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Body, MassSpringError, Material, quadratic_body, step_limit
from massspring.analysis.stiffness import spring_stiffness
from massspring.body.points import BARYCENTRIC, POINTS, SLOPES, gradients
from massspring.body.quadratic import CORNER_MASS, FACETS, PARTS_OF_FACET, boundary_facets, flat_parts
from tests.massspring.conftest import SOFT
from tests.massspring.quadratic import (
    MESHES,
    RADIUS,
    ball_mesh,
    curved_block,
    exact_volume,
    hollow_ball,
    jiggled,
    local_force,
    lumen_of,
    quadratic_block,
    shape_functions,
    straight_hollow,
    volumes_of,
)

BALL = 4.0 / 3.0 * np.pi * RADIUS**3
SHEARED = np.array([[1.1, 0.2, 0.0], [-0.1, 0.95, 0.1], [0.05, 0.0, 1.2]])


@pytest.fixture(params=MESHES)
def mesh(request):
    return MESHES[request.param]()


@pytest.fixture(params=[*MESHES, "hollow"])
def body(request) -> Body:
    return hollow_ball() if request.param == "hollow" else quadratic_body(*MESHES[request.param](), SOFT)


def test_shape_functions_are_one_at_their_node_and_sum_to_one():
    """The slopes at the points are those of the quadratics that are 1 at one node and 0 at the others."""
    step = 1e-5
    for q, b in enumerate(BARYCENTRIC):
        assert b.sum() == pytest.approx(1.0, abs=1e-15)
        for axis in range(3):
            move = np.zeros(4)
            move[0], move[axis + 1] = -step, step
            slope = np.diff(shape_functions(np.array([b - move, b + move])), axis=0)[0] / (2 * step)
            assert np.allclose(SLOPES[q, :, axis], slope, atol=1e-9)
    assert np.abs(SLOPES.sum(axis=1)).max() < 1e-14


def test_the_points_integrate_quadratics_exactly():
    """∫ b_i b_j over a tetrahedron is V (1 + δ_ij)/20."""
    assert np.allclose(BARYCENTRIC.mean(axis=0), 0.25, atol=1e-15)
    assert np.allclose(BARYCENTRIC.T @ BARYCENTRIC / POINTS, (1.0 + np.eye(4)) / 20.0, atol=1e-15)


def test_gradients_of_linear_fields_are_exact(mesh):
    points, cells = mesh
    slopes, _ = gradients(points, cells)
    assert np.abs(slopes.sum(axis=2)).max() < 1e-10 / RADIUS
    deformation = np.einsum("kai,kqaj->kqij", (points @ SHEARED.T)[cells], slopes)
    assert np.allclose(deformation, SHEARED, atol=1e-12)


@pytest.mark.parametrize("name", MESHES)
def test_weights_sum_to_the_volume(name):
    """Exactly on straight elements; on curved ones but for the cubic part of the Jacobian."""
    points, cells = MESHES[name]()
    total, exact = gradients(points, cells)[1].sum(), exact_volume(points, cells)
    assert total == pytest.approx(exact, rel=1e-12 if name == "straight" else 1e-5)


def test_the_volume_of_a_curved_ball_is_that_of_the_ball():
    """Fourth order: 42 and 162 vertices on the surface."""
    errors = [abs(gradients(*ball_mesh(levels))[1].sum() / BALL - 1.0) for levels in (1, 2)]
    assert errors[0] < 5e-3 and errors[1] < errors[0] / 10.0
    flat = [abs(quadratic_body(*ball_mesh(levels), SOFT).volume / BALL - 1.0) for levels in (1, 2)]
    assert flat[1] > 20.0 * errors[1]


def test_volumes_sum_to_the_whole_and_the_springs_are_balanced(body):
    """K X = Σ w ∇N at rest: springs −mu K and mu ∂V/∂x cancel at every node."""
    volumes = volumes_of(body)
    count = volumes.vertex_count
    assert body.rest_volumes[:count].sum() == pytest.approx(volumes.weight.sum(), rel=1e-14)
    k = spring_stiffness(body, body.rest)
    pull = k @ body.rest.ravel()
    push = volumes.jacobian(body.rest).T @ body.rest_lam
    assert np.abs(push - pull).max() <= 1e-12 * np.abs(pull).max()
    assert np.abs(k @ np.tile([1.0, -2.0, 0.5], body.node_count)).max() <= 1e-12 * np.abs(k.data).max()


def test_the_springs_have_the_energy_of_the_tissue(body):
    """½ Σ k |d|² = ½ mu Σ w |F|² at any positions."""
    x = jiggled(body)
    d = x[body.springs.ends[:, 1]] - x[body.springs.ends[:, 0]]
    f = volumes_of(body).deformation(x)
    tissue = 0.5 * SOFT.shear_modulus * np.einsum("kq,kqij,kqij->", volumes_of(body).weight, f, f)
    assert 0.5 * (body.springs.stiffness * (d * d).sum(axis=1)).sum() == pytest.approx(tissue, rel=1e-12)


def test_a_uniform_deformation_leaves_inner_nodes_without_force(body):
    """Patch test: J_q = det F everywhere, V_r = det F V0_r, and only the boundary is pulled, whatever the pressure.

    Of curved elements four points meet ∫ ∇N, of third degree, up to 1e-3 of the term of one element.
    """
    x, volumes = body.rest @ SHEARED.T, volumes_of(body)
    ratio, count = np.linalg.det(SHEARED), volumes.vertex_count
    assert np.allclose(volumes.jacobians(x), ratio, rtol=1e-12)
    assert np.allclose(volumes.measure(x)[:count], ratio * body.rest_volumes[:count], rtol=1e-12)
    lam = np.where(np.arange(volumes.count) < count, 731.0, 0.0)
    force = -(spring_stiffness(body, x) @ x.ravel()) + volumes.jacobian(x).T @ lam
    force += local_force(body, x)
    inner = np.setdiff1d(np.arange(body.node_count), body.surface_nodes)
    straight = np.allclose(volumes.weight, volumes.weight[:, :1], rtol=1e-12, atol=0)
    bound = (1e-12 if straight else 2e-3) * np.abs(force).max()
    assert len(inner) and np.abs(force.reshape(-1, 3)[inner]).max() < bound


@pytest.mark.parametrize("shear", [True, False], ids=["shear", "uniaxial"])
def test_stress_is_that_of_the_incompressible_neo_hookean_solid(shear):
    """V P = Σ f ⊗ X of the forces of a uniform deformation: mu γ in simple shear, mu (s − 1/s²) in tension with free
    sides, whose pressure is mu/s."""
    body, mu = quadratic_body(*quadratic_block(), SOFT), SOFT.shear_modulus
    gamma, s = 0.4, 1.3
    f = np.eye(3) if shear else np.diag([s**-0.5, s**-0.5, s])
    f[0, 2] = gamma if shear else 0.0
    x = body.rest @ f.T
    lam = np.full(body.kept.count, mu if shear else mu / s)
    force = spring_stiffness(body, x) @ x.ravel() - volumes_of(body).jacobian(x).T @ lam - local_force(body, x)
    stress = force.reshape(-1, 3).T @ body.rest / volumes_of(body).weight.sum()
    if shear:
        assert stress[0, 2] == pytest.approx(mu * gamma, rel=1e-12) and abs(stress[0, 1]) < 1e-9 * mu
    else:
        assert stress[2, 2] == pytest.approx(mu * (s - s**-2), rel=1e-12)
        assert np.abs(stress[:2, :2]).max() < 1e-9 * mu


def test_the_local_bulk_makes_up_for_what_the_square_lacks():
    """½ mu |F|² − mu (J − 1) + ½ b (J − 1)² under uniform growth by s has the second derivative of
    mu/2 (J^(−2/3) |F|² − 3), which is none."""
    step = 1e-3
    b = quadratic_body(*quadratic_block(), SOFT).local_bulk / SOFT.shear_modulus

    def energy(s):
        return 1.5 * s**2 - (s**3 - 1.0) + 0.5 * b * (s**3 - 1.0) ** 2

    assert (energy(1 + step) - 2 * energy(1.0) + energy(1 - step)) / step**2 == pytest.approx(0.0, abs=1e-4)
    assert b == pytest.approx(1.0 / 3.0)


def test_masses_are_positive_and_sum_to_that_of_the_tissue(body):
    total = SOFT.density * volumes_of(body).weight.sum()
    assert body.mass.sum() == pytest.approx(total, rel=1e-13) and (body.mass > 0).all()
    cells, share = volumes_of(body).cells, np.zeros(body.node_count)
    for k, volume in enumerate(volumes_of(body).weight.sum(axis=1)):
        share[cells[k, :4]] += CORNER_MASS * volume
        share[cells[k, 4:]] += (1.0 - 4.0 * CORNER_MASS) / 6.0 * volume
    assert np.allclose(body.mass, SOFT.density * share, rtol=1e-13)


def test_inertia_by_stiffness_has_the_total_mass_and_longer_steps():
    body = quadratic_body(*ball_mesh(), SOFT)
    slow = quadratic_body(*ball_mesh(), SOFT, inertia="stiffness")
    diagonal = spring_stiffness(body, body.rest).diagonal()[::3]
    assert np.array_equal(slow.mass, body.mass)
    assert np.allclose(slow.moved_mass / diagonal, body.mass.sum() / diagonal.sum(), rtol=1e-10)
    assert step_limit(slow).undamped > 1.1 * step_limit(body).undamped


def test_facets_and_flat_parts_fill_the_element():
    """Eight parts of positive volume fill an element, four triangles its side; mid-side nodes are in between."""
    points, cells = quadratic_block((1, 1, 1))
    assert np.array_equal(np.sort(FACETS[:, :3].ravel()), np.repeat(np.arange(4), 3))
    for facet in cells[:, FACETS].reshape(-1, 6):
        a, b, c = points[facet[:3]]
        assert np.allclose(points[facet[3:]], [(a + b) / 2, (b + c) / 2, (c + a) / 2])
        parts = points[facet[PARTS_OF_FACET]]
        area = np.cross(parts[:, 1] - parts[:, 0], parts[:, 2] - parts[:, 0])
        assert np.allclose(area, np.cross(b - a, c - a) / 4.0)
    body = quadratic_body(points, cells, SOFT)
    assert len(body.tetrahedra) == 8 * len(cells) and len(body.triangles) == 4 * len(boundary_facets(cells))
    assert body.tetrahedron_volumes.sum() == pytest.approx(body.volume, rel=1e-12)
    assert (body.tetrahedron_volumes > 0).all()
    assert np.array_equal(np.unique(flat_parts(points, cells)), np.arange(len(points)))


def test_the_lumen_is_one_more_volume():
    body = hollow_ball()
    volumes = volumes_of(body)
    assert volumes.names[-1] == "lumen" and volumes.count == volumes.vertex_count + 1 == len(volumes.names)
    assert body.rest_volumes[-1] == pytest.approx(0.6**3 * BALL, rel=0.06) and body.rest_volumes[-1] < 0.6**3 * BALL
    assert body.rest_lam[-1] == 0.0 and (body.rest_lam[:-1] == SOFT.shear_modulus).all()
    straight = straight_hollow()
    held = quadratic_body(*straight, SOFT, lumen_of(*straight))
    assert held.rest_volumes[-1] == pytest.approx(float(np.linalg.det(np.eye(3))) * enclosed(held, straight), rel=1e-12)


def enclosed(body: Body, mesh) -> float:
    """Inside the hull of a hollow block, less its tissue."""
    points, cells = mesh
    outer = boundary_facets(cells)
    inner = {tuple(sorted(facet)) for facet in lumen_of(points, cells)}
    triangles = np.array([facet[:3] for facet in outer if tuple(sorted(facet)) not in inner])
    a, b, c = points[triangles].transpose(1, 0, 2)
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0) - float(volumes_of(body).weight.sum())


def test_stiffening_scales_every_force():
    body = quadratic_body(*curved_block(), SOFT)
    harder, other = (
        body.stiffened(3.0),
        quadratic_body(*curved_block(), Material(3.0 * SOFT.shear_modulus, SOFT.density)),
    )
    assert np.allclose(harder.springs.stiffness, other.springs.stiffness, rtol=1e-12)
    assert harder.local_bulk == pytest.approx(other.local_bulk) and harder.rest_pressure == other.rest_pressure
    x = jiggled(body)
    assert harder.local_energy(x) == pytest.approx(3.0 * body.local_energy(x), rel=1e-13)


def test_an_element_that_folds_is_refused_with_its_place():
    points, cells = quadratic_block()
    worst = cells[7]
    points = points.copy()
    points[worst[4]] += 1.5 * (points[worst[3]] - points[worst[4]])
    with pytest.raises(MassSpringError, match=r"\d+ quadratic elements fold, the worst one at \(-?\d+\.\d, .*\) mm"):
        quadratic_body(points, cells, SOFT)


@pytest.mark.parametrize(
    ("option", "message"),
    [({"inertia": "heavy"}, "unknown inertia 'heavy'; choose lumped or stiffness"),
     ({"contact": "edges"}, "unknown contact 'edges'; choose facets or nodes")],
)  # fmt: skip
def test_unknown_options_are_refused(option, message):
    with pytest.raises(MassSpringError, match=message):
        quadratic_body(*quadratic_block(), SOFT, **option)


def test_inertia_must_be_positive_everywhere():
    body = quadratic_body(*quadratic_block(), SOFT)
    for wrong in (body.mass[:-1], np.where(np.arange(body.node_count) == 4, 0.0, body.mass)):
        with pytest.raises(MassSpringError, match="the inertia is not positive at every node"):
            replace(body, inertia=wrong)
