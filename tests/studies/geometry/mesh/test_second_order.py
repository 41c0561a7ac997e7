"""Second-order meshes: on the true shape, folded nowhere, and as accurate as they claim."""

from dataclasses import replace

import numpy as np
import pytest
import skfem
from skfem.models.poisson import laplace

from studies.base.errors import StudyError
from studies.geometry import HalfSpace, ball, curved, organ
from studies.geometry.mesh.organ_mesh import unique_edges
from studies.geometry.mesh.quality import PAIRS, curved_volume, jacobian_coefficients, smallest_jacobian
from studies.geometry.mesh.second_order import GOOD, make_curved, middle_stiffness, true_outlines, unfold
from studies.geometry.organs import SHAPES
from studies.geometry.shape.levelset import Shape, at_depth
from studies.geometry.surface.first_surface import true_volume

RADIUS = 0.05
BALL_VOLUME = 4 / 3 * np.pi * RADIUS**3
SIZES = (300, 550, 1100)


@pytest.fixture(scope="module")
def small(mesh_cache):
    """A solid and a hollow organ besides the ball, coarse."""
    return {name: organ(name, SIZES[0], regions={}) for name in ("ball", "spleen", "bladder")}


@pytest.fixture(scope="module")
def one():
    """A straight quadratic tetrahedron that is no special one."""
    corners = np.array([[0, 0, 0], [1.0, 0.1, 0], [0.2, 0.9, 0.1], [0.1, 0.3, 1.1]])
    return np.concatenate([corners, [corners[list(pair)].mean(axis=0) for pair in PAIRS]]), np.arange(10)[None]


def determinants(points, xi):
    """det dx/dxi of one quadratic tetrahedron at xi (q, 3), by central differences of its shape functions."""

    def place(xi):
        bary = np.column_stack([1 - xi.sum(axis=1), xi])
        middles = sum(4 * bary[:, [i]] * bary[:, [j]] * points[4 + k] for k, (i, j) in enumerate(PAIRS))
        return (bary * (2 * bary - 1)) @ points[:4] + middles

    step = 1e-4 * np.eye(3)
    return np.linalg.det(np.stack([(place(xi + e) - place(xi - e)) / 2e-4 for e in step], axis=2))


@pytest.mark.campaign
@pytest.mark.parametrize("name", ["bladder", "spleen"])
def test_volume_converges_at_the_orders_claimed(name):
    family = [organ(name, nodes, regions={}) for nodes in SIZES]
    exact = true_volume(SHAPES[name]())
    straight = [abs(mesh.volume / exact - 1) for mesh in family]
    smooth = [abs(curved(mesh).volume / exact - 1) for mesh in family]
    assert smooth[1] < 5e-4
    size = -0.5 * np.log(SIZES)
    assert np.polyfit(size, np.log(straight), 1)[0] >= 1.8
    assert np.polyfit(size, np.log(smooth), 1)[0] >= 3.5


@pytest.mark.parametrize("name", ["ball", "spleen", "bladder"])
def test_nodes_are_on_the_true_surfaces_and_nothing_folds(small, name):
    shape = SHAPES[name]()
    mesh = small[name]
    made = curved(mesh)
    assert made.smallest_jacobian > 0
    assert made.vertex_count == len(mesh.points) and (made.points[: len(mesh.points)] == mesh.points).all()
    assert (made.cells[:, :4] == mesh.tetrahedra).all()
    pairs = np.sort(made.cells[:, np.array(PAIRS)].reshape(-1, 2), axis=1)
    middle = dict(zip(map(tuple, pairs.tolist()), made.cells[:, 4:].ravel().tolist(), strict=True))
    assert len(middle) == len(made.points) - len(mesh.points)  # neighbours share their mid-side nodes
    for triangles, depth in ((mesh.outer_triangles, 0.0), (mesh.lumen_triangles, shape.wall)):
        if not len(triangles):
            continue
        nodes = [middle[edge] for edge in map(tuple, unique_edges(triangles).tolist())]
        # The projection stops at 1e-13 of the box.
        assert np.abs(at_depth(shape, depth).level(made.points[nodes])).max() < 1e-12


def test_outlines_of_attachments_are_curves():
    """The rim of a cap of a ball is a circle: its mid-side nodes are on it, not on the chords."""
    cap = 0.035
    mesh = ball(300, RADIUS, {"top": HalfSpace((0.0, 0.0, cap), (0.0, 0.0, -1.0))})
    made = curved(mesh)
    rim = true_outlines(mesh)[0][0]
    assert len(rim) > 10
    ends = np.sort(made.cells[:, np.array(PAIRS)].reshape(-1, 2), axis=1).tolist()
    middle = dict(zip(map(tuple, ends), made.cells[:, 4:].ravel().tolist(), strict=True))
    points = made.points[[middle[edge] for edge in map(tuple, rim.tolist())]]
    assert np.abs(points[:, 2] - cap).max() < 1e-13
    assert np.abs(np.hypot(points[:, 0], points[:, 1]) - np.sqrt(RADIUS**2 - cap**2)).max() < 1e-13


def test_a_wall_folds_unless_its_inner_nodes_follow(small):
    """The test of the tests: surfaces curved alone cut through a thin wall."""
    mesh = small["bladder"]
    made = curved(mesh)
    straight = made.points.copy()
    ends = made.cells[:, np.array(PAIRS)]
    straight[made.cells[:, 4:]] = mesh.points[ends].mean(axis=2)
    edge_keys = np.sort(ends.reshape(-1, 2), axis=1) @ [len(mesh.points), 1]
    inner = ~np.isin(edge_keys, unique_edges(mesh.triangles) @ [len(mesh.points), 1])
    alone = made.points.copy()
    nodes = made.cells[:, 4:].ravel()[inner]
    alone[nodes] = straight[nodes]
    # Measured -3.4 and 0.58; with single nodes moved one by one instead it ends where `unfold` stops, at 0.12.
    assert smallest_jacobian(alone, made.cells).min() < 0 < 3 * GOOD < made.smallest_jacobian


def test_coefficients_bound_the_determinant_and_average_to_it(one):
    points, cells = one
    rng = np.random.default_rng(1)
    for size in (0.0, 0.05, 0.15):
        bent = points + size * rng.uniform(-1, 1, points.shape) * (np.arange(10) > 3)[:, None]
        xi = rng.dirichlet(np.ones(4), 400)[:, 1:]
        values, coefficients = determinants(bent, xi), jacobian_coefficients(bent, cells)[0]
        # Differences of a quadratic are exact up to rounding over the step.
        assert coefficients.min() - 1e-9 <= values.min() and values.max() <= coefficients.max() + 1e-9
        corners = determinants(bent, np.eye(4)[:, 1:])
        assert all(np.abs(coefficients - value).min() < 1e-9 for value in corners)  # a corner is a coefficient
    assert jacobian_coefficients(points, cells)[0] == pytest.approx(np.full(20, determinants(points, xi[:1])[0]))
    # The volume against quadrature, exact for cubics, in scikit-fem.
    mesh = skfem.MeshTet2(bent[[0, 1, 2, 3, 4, 6, 7, 5, 8, 9]].T, np.arange(4)[:, None])
    other = skfem.Functional(lambda w: 1.0 + 0 * w.x[0]).assemble(skfem.Basis(mesh, skfem.ElementTetP1(), intorder=4))
    assert abs(curved_volume(bent, cells)) == pytest.approx(abs(other), rel=1e-12)


def test_a_fold_between_the_corners_is_seen(one):
    points, cells = one
    folded = points.copy()
    folded[4] += [0.0, 0.75, 0.0]  # far over the middle of the edge 0-1
    assert smallest_jacobian(points, cells)[0] == pytest.approx(1.0)
    assert smallest_jacobian(folded, cells)[0] < 0
    assert determinants(folded, np.random.default_rng(0).dirichlet(np.ones(4), 2000)[:, 1:]).min() < 0


def test_middle_stiffness_is_that_of_scikit_fem(one):
    points, _ = one
    mesh = skfem.MeshTet(points[:4].T, np.arange(4)[:, None])
    basis = skfem.Basis(mesh, skfem.ElementTetP2())
    whole = laplace.assemble(basis).toarray()
    # Its mid-side degrees of freedom, in the order of the ends of PAIRS.
    place = basis.doflocs.T
    rows = [int(np.argmin(np.linalg.norm(place - points[4 + k], axis=1))) for k in range(6)]
    assert middle_stiffness(points[:4], np.arange(4)[None])[0] == pytest.approx(whole[np.ix_(rows, rows)])


def test_a_folded_element_is_unfolded_and_fixed_nodes_stay(small):
    made = curved(small["spleen"])
    inner = np.ones(len(made.points), bool)
    inner[: made.vertex_count] = False
    node = made.cells[len(made.cells) // 2, 9]
    points = made.points.copy()
    edge = made.cells[len(made.cells) // 2, [2, 3]]
    points[node] += 0.6 * (points[edge[1]] - points[edge[0]])[[1, 2, 0]]
    assert smallest_jacobian(points, made.cells).min() < 0
    assert smallest_jacobian(unfold(points, made.cells, inner), made.cells).min() >= GOOD
    assert (unfold(points, made.cells, np.zeros(len(points), bool)) == points).all()


def test_true_volume_meets_closed_forms():
    assert true_volume(SHAPES["ball"](RADIUS)) == pytest.approx(BALL_VOLUME, rel=1e-6)
    hollow = BALL_VOLUME * (1 - 0.8**3)
    assert true_volume(SHAPES["ball"](RADIUS, 0.2 * RADIUS)) == pytest.approx(hollow, rel=1e-6)
    axes = np.array([0.05, 0.04, 0.03])
    egg = Shape("egg", lambda x: 0.03 * (np.linalg.norm(x / axes, axis=1) - 1), (-0.06,) * 3, (0.06,) * 3, 0.004)
    assert true_volume(egg) == pytest.approx(4 / 3 * np.pi * axes.prod(), rel=1e-6)


def test_a_mesh_that_cannot_follow_its_shape_is_refused():
    mesh = ball(150)
    shrunk = mesh.recipe | {"parameters": {"radius": 0.6 * RADIUS}}
    with pytest.raises(StudyError, match="elements fold when they follow the true shape at 150 surface nodes"):
        make_curved(replace(mesh, recipe=shrunk))
