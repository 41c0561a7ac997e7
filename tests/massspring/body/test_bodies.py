"""Bodies: mass, springs, smallest volume ratios, and what is refused."""

import numpy as np
import pytest

from massspring import Body, MassSpringError, membrane_body, quadratic_body, surface_body, tetrahedral_body
from massspring.body.points import FAR
from massspring.body.springs import SpringKind
from massspring.body.volumes import tetrahedron_volumes
from tests.massspring.conftest import SOFT, block, icosphere
from tests.massspring.quadratic import bodies, second_order

EXACT = 1e-12


def test_the_mass_is_density_times_volume(body):
    assert body.mass.sum() == pytest.approx(SOFT.density * body.volume, rel=EXACT)
    # Mutant: inverse masses summed instead of masses.
    assert (1 / body.mass).sum() != pytest.approx(SOFT.density * body.volume, rel=0.5)


def test_the_stiffness_matches_the_shear_modulus(body):
    """Σ k L² = 15 V mu: affine homogenisation of central forces (eq. 4.1)."""
    k, length = body.springs.stiffness, body.springs.rest_length
    assert float(k @ length**2) / (15 * body.volume) == pytest.approx(SOFT.shear_modulus, rel=EXACT)


@pytest.mark.parametrize("law", ["van_gelder", "uniform"])
def test_affine_shear_costs_half_mu_gamma_squared(law):
    """Outside truth: ½ mu gamma² V, the energy of simple shear of an isotropic solid, on average over shear planes.

    300 random planes leave a standard error of about 1.5 %; three of them are allowed.
    """
    body = tetrahedral_body(*block((3, 3, 3)), SOFT, law)
    random, gamma, moduli = np.random.default_rng(4), 1e-3, []
    for _ in range(300):
        frame, _ = np.linalg.qr(random.normal(size=(3, 3)))
        x = body.rest + gamma * np.outer(body.rest @ frame[:, 1], frame[:, 0])
        stretch = np.linalg.norm(x[body.springs.ends[:, 1]] - x[body.springs.ends[:, 0]], axis=1)
        energy = 0.5 * float(body.springs.stiffness @ (stretch - body.springs.rest_length) ** 2)
        moduli.append(energy / (0.5 * gamma**2 * body.volume))
    assert np.mean(moduli) == pytest.approx(SOFT.shear_modulus, rel=0.045)


def test_a_surface_body_is_built_as_in_the_paper(ball_body):
    """Euler: 3(n − 2) edges; a bending spring per edge but for those that are edges; one inner spring per node."""
    surface = len(ball_body.surface_nodes)
    kinds = np.bincount(ball_body.springs.kind, minlength=len(SpringKind))
    virtual = ball_body.node_count - surface
    assert len(ball_body.triangles) == 2 * surface - 4
    assert kinds[SpringKind.STRUCTURAL] == 3 * (surface - 2)
    assert 0.9 * kinds[SpringKind.STRUCTURAL] < kinds[SpringKind.BENDING] <= kinds[SpringKind.STRUCTURAL]
    assert kinds[SpringKind.INNER] == surface
    assert kinds[SpringKind.AXIAL] == virtual - 1
    assert len(np.unique(np.sort(ball_body.springs.ends, axis=1), axis=0)) == ball_body.springs.count


def changed(body: Body, **parts: object) -> Body:
    fields = {"rest": body.rest, "mass": body.mass, "springs": body.springs, "triangles": body.triangles}
    return Body(**{**fields, "tetrahedra": body.tetrahedra, **parts})  # type: ignore[arg-type]


def with_nan(body: Body) -> np.ndarray:
    rest = body.rest.copy()
    rest[3, 1] = np.nan
    return rest


REFUSED = {
    "open": (lambda b: {"triangles": b.triangles[1:]}, "open at 3 edges"),
    "inverted": (lambda b: {"triangles": b.triangles[:, ::-1].copy()}, "flat or inverted"),
    "one triangle turned": (lambda b: {"triangles": turned(b)}, "not consistently oriented"),
    "doubled": (lambda b: {"triangles": np.vstack([b.triangles, b.triangles])}, "not manifold"),
    "nan": (lambda b: {"rest": with_nan(b)}, "not finite"),
    "massless": (lambda b: {"mass": np.where(np.arange(b.node_count) == 2, 0.0, b.mass)}, "node 2 has mass 0"),
    "too few masses": (lambda b: {"mass": b.mass[:-1]}, "one mass per node"),
    "flat": (lambda b: {"rest": b.rest * [1, 1, 0]}, "flat or inverted"),
    "missing node": (lambda b: {"triangles": b.triangles + 10}, "names node"),
    "one triangle": (lambda b: {"triangles": b.triangles[:1]}, "at least 4"),
}


def with_first(array: np.ndarray, value: float) -> np.ndarray:
    changed_array = array.astype(np.result_type(array, np.array(value)))
    changed_array[0, 0] = value
    return changed_array


ARRAYS = {
    "a node below 0": (lambda p, t, c: (p, t, with_first(c.astype(np.int64), -1)), "tetrahedra name node -1"),
    "a node too many": (lambda p, t, c: (p, t, with_first(c, len(p))), "nodes are numbered from 0 to"),
    "a triangle's node": (lambda p, t, c: (p, with_first(t.astype(np.int64), -1), c), "triangles name node -1"),
    "fractions": (lambda p, t, c: (p, t, c + 0.7), "the tetrahedra are float64 .*; give whole numbers"),
    "nan": (lambda p, t, c: (p, t, c * np.nan), "the tetrahedra are float64"),
    "columns": (lambda p, t, c: (p, c, c), r"the triangles are .* of shape .* 4\); give whole numbers"),
    "none": (lambda p, t, c: (p, t, c[:0]), "no tetrahedra"),
    "complex": (lambda p, t, c: (p + 1j, t, c), r"the points are complex128 .*; give real numbers \(n, 3\) \[m\]"),
    "text": (lambda p, t, c: (p.astype(str), t, c), "the points are <U"),
    "flat list": (lambda p, t, c: (p.ravel(), t, c), "the points are float64 of shape"),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_arrays_that_are_no_mesh_are_refused_in_one_sentence(name):
    """A node below 0 was read as one of 4 billion, outside all memory."""
    spoil, words = ARRAYS[name]
    with pytest.raises(MassSpringError, match=words):
        tetrahedral_body(*spoil(*block((2, 2, 2))), SOFT)


def test_every_body_refuses_nodes_that_do_not_exist():
    points, triangles = icosphere(1)
    wrong = with_first(triangles.astype(np.int64), -1)
    for make in (
        lambda: surface_body(points, wrong, SOFT),
        lambda: membrane_body(points, wrong, 0.001, SOFT),
        lambda: quadratic_body(points, np.full((1, 10), -1), SOFT),
    ):
        with pytest.raises(MassSpringError, match="name node -1"):
            make()


def turned(body: Body) -> np.ndarray:
    triangles = body.triangles.copy()
    triangles[0] = triangles[0, ::-1]
    return triangles


@pytest.mark.parametrize("name", REFUSED)
def test_bad_bodies_are_refused_in_one_sentence(ball_body, name):
    parts, words = REFUSED[name]
    with pytest.raises(MassSpringError, match=words) as caught:
        changed(ball_body, **parts(ball_body))
    assert "\n" not in str(caught.value)


def test_a_negative_tetrahedron_is_refused(block_body):
    cells = block_body.tetrahedra.copy()
    cells[4] = cells[4, [1, 0, 2, 3]]
    with pytest.raises(MassSpringError, match="tetrahedron 4 has volume -"):
        changed(block_body, tetrahedra=cells)


def test_a_spring_without_length_is_refused(block_body):
    from dataclasses import replace

    length = block_body.springs.rest_length.copy()
    length[7] = 0.0
    with pytest.raises(MassSpringError, match="spring 7 has rest length 0"):
        changed(block_body, springs=replace(block_body.springs, rest_length=length))


SHEARED = np.array([[1.1, 0.2, 0.0], [-0.1, 0.95, 0.1], [0.05, 0.0, 1.2]])
MIRRORED = np.diag([1.0, 1.0, -1.0])
EDGE = 0.02


@pytest.fixture(params=["block_body", *bodies()])
def solid(request):
    return bodies()[request.param] if request.param in bodies() else request.getfixturevalue(request.param)


@pytest.mark.parametrize("map_", [np.eye(3), SHEARED, MIRRORED], ids=["rest", "sheared", "mirrored"])
def test_a_linear_map_has_its_determinant_everywhere(solid, map_):
    assert solid.measured(solid.rest @ map_.T).least_j == pytest.approx(np.linalg.det(map_), rel=1e-9)


def test_the_smallest_counts(solid):
    """One node moved: some elements lose volume, others gain it."""
    x = solid.rest.copy()
    x[np.argmin(np.linalg.norm(x - x.mean(axis=0), axis=1))] += 0.1 * EDGE
    assert solid.measured(x).least_j < 1.0 - 1e-3


@pytest.mark.filterwarnings("ignore:invalid value encountered in det")
def test_no_number_is_seen(solid):
    x = solid.rest.copy()
    x[-1, 1] = np.nan
    assert np.isnan(solid.measured(x).least_j)


def test_a_surface_has_no_elements(ball_body):
    assert np.isnan(ball_body.measured(ball_body.rest).least_j)


def test_a_quadratic_element_is_read_at_its_points():
    """x → x + a (x/L − 1)² L has J = 1 + 2a (x/L − 1): negative at three corners, 1 − 1.5 a in the flat parts between
    its nodes there, and positive at its points, where springs and volumes see it."""
    a = 0.55
    points, cells = second_order(EDGE * np.vstack([np.zeros(3), np.eye(3)]), np.arange(4)[None])
    body = quadratic_body(points, cells, SOFT)
    x = points.copy()
    x[:, 0] += a * EDGE * (points[:, 0] / EDGE - 1.0) ** 2
    at_points, in_parts = 1.0 + 2.0 * a * (FAR - 1.0), 1.0 - 1.5 * a
    assert body.measured(x).least_j == pytest.approx(at_points, rel=1e-9)
    parts = tetrahedron_volumes(x, body.tetrahedra) / body.tetrahedron_volumes
    assert parts.min() == pytest.approx(in_parts, rel=1e-9) and 1.0 - 2.0 * a < 0.0 < at_points < in_parts
