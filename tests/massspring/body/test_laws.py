"""Stiffness laws: what they claim, springs without length, smoothed springs."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import Basis, BilinearForm, ElementTetP1, MeshTet
from skfem.helpers import dot, grad

from massspring import (
    Body,
    Clock,
    Free,
    ImplicitVolume,
    MassSpringError,
    Setup,
    Volumes,
    surface_body,
    tetrahedral_body,
)
from massspring.analysis.stiffness import spring_stiffness, stiffness_at_rest, volume_hessian
from massspring.body.build import SURFACE_WEIGHTS
from massspring.body.laws import LAWS, Edges
from massspring.body.smoothed import FACES, SMOOTHED
from massspring.body.springs import EDGES_OF_TETRAHEDRON, SpringKind
from massspring.kernels.forces.volume import volume_gradient_into
from tests.massspring.conftest import SOFT, block, icosphere
from tests.massspring.kernels.forces.test_forces import energy, forces, gradient, moved

EXACT = 1e-12
MU = SOFT.shear_modulus
MATCHED = tuple(law.name for law in LAWS if law.matched)


@pytest.fixture(scope="module")
def taut() -> Body:
    """The cotangent network of a distorted block with one volume per node."""
    body = tetrahedral_body(*block((3, 3, 2)), SOFT, "cotangent")
    return body.keeping(Volumes.nodal(body))


def inner_distortion(cells: int) -> tuple[np.ndarray, ...]:
    """A straight block whose inner nodes alone are moved."""
    straight, triangles, tetrahedra = block((cells, cells, cells), distortion=0.0)
    points, _, _ = block((cells, cells, cells), distortion=0.2)
    inside = np.ones(len(points), dtype=bool)
    inside[np.unique(triangles)] = False
    return np.where(inside[:, None], points, straight), triangles, tetrahedra


@pytest.mark.parametrize("law", [law.name for law in LAWS])
def test_every_law_names_itself_and_scales_with_mu(law):
    soft, hard = (tetrahedral_body(*block((2, 2, 2)), replace(SOFT, shear_modulus=f * MU), law) for f in (1.0, 3.0))
    assert soft.law == law
    assert np.allclose(hard.springs.stiffness, 3 * soft.springs.stiffness, rtol=EXACT)


@pytest.mark.parametrize("law", MATCHED)
def test_matched_laws_have_the_shear_modulus_of_affine_homogenisation(law):
    body = tetrahedral_body(*block((3, 2, 2)), SOFT, law)
    k, length = body.springs.stiffness, body.springs.rest_length
    assert float(k @ length**2) / (15 * body.volume) == pytest.approx(MU, rel=EXACT)


def test_lloyd_of_a_regular_tetrahedron():
    """By hand: six springs of (2√2/25) 2.5 mu L, V = L³/(6√2): Σ k L²/(15 V) = 0.96 mu."""
    points = 0.01 * np.array([[1, 1, 1], [1, -1, -1], [-1, -1, 1], [-1, 1, -1.0]])
    faces = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
    body = tetrahedral_body(points, faces, np.array([[0, 1, 2, 3]]), SOFT, "lloyd")
    assert float(body.springs.stiffness @ body.springs.rest_length**2) / (15 * body.volume) == pytest.approx(
        0.96 * MU, rel=EXACT
    )


def test_the_cotangent_network_is_the_laplacian_of_linear_tetrahedra():
    """Outside truth: scikit-fem assembles ∫ mu ∇u·∇v on the same mesh."""
    points, triangles, tetrahedra = block((3, 3, 2))
    body = tetrahedral_body(points, triangles, tetrahedra, SOFT, "cotangent")
    basis = Basis(MeshTet(points.T, tetrahedra.T), ElementTetP1())
    laplacian = BilinearForm(lambda u, v, w: MU * dot(grad(u), grad(v))).assemble(basis).toarray()
    i, j = body.springs.ends.T
    assert np.abs(laplacian[i, j] + body.springs.stiffness).max() < EXACT * np.abs(laplacian).max()
    assert (body.springs.stiffness < 0).any(), "no obtuse angle: the sign of negative weights is not seen"


def test_springs_without_length_store_the_energy_of_a_neo_hookean_solid(taut):
    """½ Σ k d² = Σ_t V_t ½ mu |F_t|², F from the corners of each tetrahedron; above rest: ½ mu (|F|² − 3)."""
    x = moved(taut)
    there, here = (p[taut.tetrahedra][:, 1:] - p[taut.tetrahedra][:, :1] for p in (x, taut.rest))
    f = np.linalg.solve(here, there)
    solid = 0.5 * MU * float(taut.tetrahedron_volumes @ ((f**2).sum(axis=(1, 2)) - 3.0))
    assert energy(taut, x) - taut.rest_energy == pytest.approx(solid, rel=1e-10)


@pytest.mark.parametrize("stretch", [0.7, 0.9, 1.5])
def test_a_stretched_block_pulls_as_the_closed_form_says(stretch):
    """Incompressible neo-Hookean bar: force mu A0 (λ − λ⁻²), pressure mu/λ; affine, so exact on any mesh."""
    body = tetrahedral_body(*inner_distortion(3), SOFT, "cotangent")
    x = body.rest * [stretch, stretch**-0.5, stretch**-0.5]
    inside = forces(body, x) + MU / stretch * gradient(body, x)
    left, right = (np.isclose(body.rest[:, 0], end(body.rest[:, 0])) for end in (np.min, np.max))
    size = float(np.abs(inside).max())
    assert np.abs(inside[~(left | right)]).max() < 1e-10 * size
    area = body.volume / np.ptp(body.rest[:, 0])
    assert inside[left, 0].sum() == pytest.approx(MU * area * (stretch - stretch**-2), rel=1e-10)


def test_with_fewer_volumes_or_no_pressure_it_is_refused(taut):
    whole = replace(taut, volumes=None)
    with pytest.raises(MassSpringError, match="keeps 1 volumes for 48 nodes; keep one volume per node"):
        Setup(whole, ImplicitVolume(), Clock(0.01, 1, 10))
    with pytest.raises(MassSpringError, match=r"method 'free' does not apply .* no springs without length"):
        Setup(taut, Free(), Clock(0.01, 1, 10))


def test_springs_without_length_between_welded_nodes_are_refused(taut):
    ends = taut.springs.ends.copy()
    ends[3] = ends[3, 0]
    with pytest.raises(MassSpringError, match="spring 3 has rest length 0 m; weld"):
        replace(taut, springs=replace(taut.springs, ends=ends))


@pytest.mark.parametrize("pressure", [0.5 * MU, -MU])
def test_a_rest_pressure_out_of_balance_is_refused(taut, pressure):
    with pytest.raises(MassSpringError, match="does not balance"):
        replace(taut, rest_pressure=pressure)


def test_stiffened_it_is_still_in_balance(taut):
    assert taut.stiffened(3.0).rest_pressure == 3.0 * MU


def test_volumes_that_do_not_add_up_cannot_carry_the_rest_pressure(taut):
    half = replace(taut, volumes=Volumes(taut.kept.names[::2], taut.kept.triangles, taut.kept.share[::2]))
    with pytest.raises(MassSpringError, match="do not add up to the whole body"):
        _ = half.rest_lam


@pytest.mark.parametrize("law", ["van_gelder", "cotangent"])
def test_the_tangents_are_derivatives_of_the_forces(law):
    """Central differences of springs away from rest, and of springs with rest pressure at rest."""
    body = tetrahedral_body(*block((3, 3, 2)), SOFT, law)
    direction = np.random.default_rng(1).uniform(-1, 1, body.rest.shape)
    step = 1e-7 * body.size

    def change(function, x):
        return (function(x + step * direction) - function(x - step * direction)) / (2 * step)

    x = moved(body)
    exact = -(spring_stiffness(body, x) @ direction.ravel()).reshape(-1, 3)
    assert np.abs(change(lambda y: forces(body, y), x) - exact).max() < 1e-6 * np.abs(exact).max()
    hessian = (volume_hessian(body.triangles, x) @ direction.ravel()).reshape(-1, 3)
    assert np.abs(change(lambda y: gradient(body, y), x) - hessian).max() < 1e-6 * np.abs(hessian).max()
    exact = -(stiffness_at_rest(body) @ direction.ravel()).reshape(-1, 3)
    at_rest = change(lambda y: forces(body, y) + body.rest_pressure * gradient(body, y), body.rest)
    assert np.abs(at_rest - exact).max() < 1e-6 * np.abs(exact).max()


def test_chosen_weights_of_a_surface_body_are_kept_and_matched():
    plain, bent = (surface_body(*icosphere(2), SOFT, weights=w) for w in (None, (1.0, 4.0, 0.25, 0.5)))
    assert np.array_equal(
        plain.springs.stiffness,
        surface_body(*icosphere(2), SOFT, weights=tuple(SURFACE_WEIGHTS.values())).springs.stiffness,
    )
    k = {kind: bent.springs.stiffness[bent.springs.kind == kind][0] for kind in SURFACE_WEIGHTS}
    assert k[SpringKind.BENDING] == pytest.approx(4 * k[SpringKind.STRUCTURAL], rel=EXACT)
    assert k[SpringKind.INNER] == pytest.approx(0.25 * k[SpringKind.STRUCTURAL], rel=EXACT)
    assert k[SpringKind.AXIAL] == pytest.approx(0.5 * k[SpringKind.STRUCTURAL], rel=EXACT)
    assert float(bent.springs.stiffness @ bent.springs.rest_length**2) / (15 * bent.volume) == pytest.approx(MU)
    assert (plain.law, bent.law) == ("per_kind", "per_kind 1:4:0.25:0.5")


def test_the_gradient_of_the_rest_pressure_is_that_of_the_whole(taut):
    """Σ_r p_r J_r = mu dV/dx at rest: what each nodal volume takes is mu."""
    assert np.allclose(taut.rest_lam, MU, rtol=1e-10)
    whole = np.empty_like(taut.rest)
    volume_gradient_into(taut.rest, taut.triangles, whole)
    assert np.abs(forces(taut, taut.rest) + MU * whole).max() < 1e-10 * np.abs(whole).max() * MU


SIDES = {"edge_smoothed": EDGES_OF_TETRAHEDRON, "face_smoothed": FACES}


@pytest.fixture(params=SMOOTHED)
def smoothed_law(request):
    return request.param


def body_of(law):
    body = tetrahedral_body(*block((3, 2, 2)), SOFT, law)
    return body.keeping(Volumes.nodal(body))


def smoothed_energy(body, x, sides):
    """½ mu Σ_s V_s |F̃_s|² [J], domain after domain."""
    edges = Edges(body.rest, body.tetrahedra)
    f = np.einsum("tai,taj->tij", x[body.tetrahedra], edges.gradients())
    share, domains = edges.volumes / len(sides), {}
    for t, cell in enumerate(body.tetrahedra):
        for side in sides:
            domains.setdefault(tuple(sorted(cell[side])), []).append(t)
    total = 0.0
    for cells in domains.values():
        volume = share[cells].sum()
        mean = np.einsum("t,tij->ij", share[cells], f[cells]) / volume
        total += 0.5 * SOFT.shear_modulus * volume * (mean**2).sum()
    return total


def shaken(body):
    return body.rest + 0.1 * body.size * np.random.default_rng(4).normal(size=body.rest.shape)


def test_the_springs_hold_the_smoothed_energy(smoothed_law):
    body = body_of(smoothed_law)
    x = shaken(body)
    assert energy(body, x) == pytest.approx(smoothed_energy(body, x, SIDES[smoothed_law]), rel=1e-12)


def test_uniform_stretch_has_the_energy_of_the_solid(smoothed_law):
    body, f = body_of(smoothed_law), np.array([[1.2, 0.1, 0.0], [0.0, 0.9, 0.3], [0.1, 0.0, 1.1]])
    whole = 0.5 * SOFT.shear_modulus * body.volume * (f**2).sum()
    assert energy(body, body.rest @ f.T) == pytest.approx(whole, rel=1e-12)


def test_springs_join_more_than_edges(smoothed_law):
    edges = {tuple(pair) for pair in np.sort(body_of("cotangent").springs.ends, axis=1).tolist()}
    pairs = {tuple(pair) for pair in np.sort(body_of(smoothed_law).springs.ends, axis=1).tolist()}
    assert edges < pairs
