"""Bodies of quadratic tetrahedra: integration, volumes, stress, masses, derivatives by differences."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Body, MassSpringError, quadratic_body, step_limit
from massspring.analysis.stiffness import spring_stiffness, stiffness_at_rest
from massspring.body.points import BARYCENTRIC, POINTS, SLOPES, gradients
from massspring.body.quadratic import CORNER_MASS, FACETS, PARTS_OF_FACET, boundary_facets, flat_parts
from tests.massspring.conftest import SOFT
from tests.massspring.quadratic import (
    MESHES,
    RADIUS,
    ball_mesh,
    hollow_ball,
    jiggled,
    local_force,
    lumen_of,
    mixed_solid,
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


@pytest.fixture(params=[*MESHES, "hollow", "mixed", "mixed hollow"])
def body(request) -> Body:
    if request.param == "mixed":
        return mixed_solid()
    if request.param not in MESHES:
        return hollow_ball(mixed=request.param == "mixed hollow")
    return quadratic_body(*MESHES[request.param](), SOFT)


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


def test_the_volume_of_a_curved_ball_is_that_of_the_ball():
    """Fourth order: 42 and 162 vertices on the surface."""
    errors = [abs(gradients(*ball_mesh(levels))[1].sum() / BALL - 1.0) for levels in (1, 2)]
    assert errors[0] < 5e-3 and errors[1] < errors[0] / 10.0
    flat = [abs(quadratic_body(*ball_mesh(levels), SOFT).volume / BALL - 1.0) for levels in (1, 2)]
    assert flat[1] > 20.0 * errors[1]


def test_volumes_sum_to_the_whole_and_the_springs_are_balanced(body):
    """K X = Σ w ∇N at rest: springs −mu K and mu ∂V/∂x cancel at every node."""
    volumes = volumes_of(body)
    count = volumes.tissue_count
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


def test_elements_with_a_volume_of_their_own_keep_that_of_their_points():
    """Vertices have what the other elements give them; one that no other element names has no volume."""
    points, cells = quadratic_block()
    own = (cells[:, :4] == cells[0, 0]).any(axis=1)
    body = quadratic_body(points, cells, SOFT, own_volumes=own)
    volumes, x = volumes_of(body), jiggled(body)
    vertices = len(np.unique(cells[:, :4])) - 1
    assert volumes.names == (
        *(f"vertex {r}" for r in range(vertices)), *(f"element {e}" for e in np.flatnonzero(own))
    )  # fmt: skip
    each = volumes.weight * volumes.jacobians(x)
    assert np.allclose(volumes.measure(x)[vertices:], each[own].sum(axis=1), rtol=1e-13)
    plain = quadratic_body(points, cells, SOFT)
    shares = each[~own] @ BARYCENTRIC
    number = np.searchsorted(np.unique(cells[~own, :4]), cells[~own, :4])
    assert np.allclose(volumes.measure(x)[:vertices], np.bincount(number.ravel(), shares.ravel()), rtol=1e-13)
    assert volumes.measure(x).sum() == pytest.approx(volumes_of(plain).measure(x).sum(), rel=1e-13)


def test_the_lumen_is_one_more_volume():
    body = hollow_ball()
    volumes = volumes_of(body)
    assert volumes.names[-1] == "lumen" and volumes.count == volumes.tissue_count + 1 == len(volumes.names)
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


def test_an_element_that_folds_is_refused_with_its_place():
    points, cells = quadratic_block()
    worst = cells[7]
    points = points.copy()
    points[worst[4]] += 1.5 * (points[worst[3]] - points[worst[4]])
    with pytest.raises(MassSpringError, match=r"\d+ quadratic elements fold, the worst one at \(-?\d+\.\d, .*\) mm"):
        quadratic_body(points, cells, SOFT)


def test_inertia_must_be_positive_everywhere():
    body = quadratic_body(*quadratic_block(), SOFT)
    for wrong in (body.mass[:-1], np.where(np.arange(body.node_count) == 4, 0.0, body.mass)):
        with pytest.raises(MassSpringError, match="the inertia is not positive at every node"):
            replace(body, inertia=wrong)


def difference(function, x: np.ndarray, step: float):
    """Along a fixed direction: central difference of `function`, and the direction (3n,)."""
    along = np.random.default_rng(2).standard_normal(x.shape)
    return (function(x + step * along) - function(x - step * along)) / (2.0 * step), along.ravel()


def test_the_gradient_of_the_volumes_is_their_difference(body):
    x, volumes = jiggled(body), volumes_of(body)
    slope, along = difference(volumes.measure, x, 1e-4 * RADIUS)
    derivative = volumes.jacobian(x) @ along
    assert np.allclose(derivative, slope, rtol=0, atol=1e-6 * np.abs(slope).max())


def test_forces_are_the_gradient_of_the_energy(body):
    """½ k d² + ½ b w (J − 1)² − Σ lam V, with a pressure that differs from volume to volume."""
    x, volumes = jiggled(body), volumes_of(body)
    lam = 500.0 + 300.0 * np.random.default_rng(4).standard_normal(volumes.count)

    def energy(x):
        d = x[body.springs.ends[:, 1]] - x[body.springs.ends[:, 0]]
        taut = 0.5 * (body.springs.stiffness * (d * d).sum(axis=1)).sum()
        return np.array([taut + body.measured(x).local_energy - lam @ volumes.measure(x)])

    slope, along = difference(energy, x, 1e-5 * RADIUS)
    force = -(spring_stiffness(body, x) @ x.ravel()) + local_force(body, x) + volumes.jacobian(x).T @ lam
    assert force @ along == pytest.approx(-slope[0], abs=1e-8 * float(np.abs(force) @ np.abs(along)))


def test_the_stiffness_at_rest_is_that_of_all_forces(body):
    volumes = volumes_of(body)
    solid = np.where(np.arange(volumes.count) < volumes.tissue_count, body.rest_pressure, 0.0)

    def force(x):
        return -(spring_stiffness(body, x) @ x.ravel()) + local_force(body, x) + volumes.jacobian(x).T @ solid

    slope, along = difference(force, body.rest, 1e-4 * RADIUS)
    stiffness = stiffness_at_rest(body)
    assert np.allclose(stiffness @ along, -slope, rtol=0, atol=1e-5 * np.abs(slope).max())
    spin = np.cross([0.3, -0.5, 0.8], body.rest).ravel()
    assert np.abs(stiffness @ spin).max() < 1e-10 * abs(stiffness).max() * np.abs(spin).max()
