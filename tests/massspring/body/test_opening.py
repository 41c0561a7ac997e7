"""Meshes opened along inner faces, or cut along a sheet that no face follows."""

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from massspring import (
    Body,
    Event,
    ExplicitElements,
    ImplicitVolume,
    MassSpringError,
    Setup,
    Volumes,
    make_clock,
    step_limit,
    tetrahedral_body,
)
from massspring.analysis.stiffness import stiffness_at_rest
from massspring.body.opening import opened
from massspring.body.partition import cell_graph, tetrahedron_faces
from massspring.body.virtual_nodes import VirtualNodes, part_in_front, virtual_nodes
from massspring.body.volumes import tetrahedron_volumes
from massspring.kernels.constraint.jacobian import rows_into
from tests.massspring.conftest import SOFT, block, boundary
from tests.massspring.cuts import CELLS, body_of_cells, cut_block, layer_faces

WHOLE, HALF = np.inf, 2
KINDS = [(False, "van_gelder"), (False, "lloyd"), (False, "cotangent"), (True, "quadratic")]


def euler(triangles: np.ndarray) -> int:
    edges = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    return len(np.unique(triangles)) - len(edges) + len(triangles)


def pieces(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    return connected_components(cell_graph(points, cells), directed=False)[1]


def test_a_whole_section_leaves_two_balls_and_half_of_one_leaves_one():
    for reach, parts in ((WHOLE, 2), (HALF, 1)):
        points, cells, opening = cut_block(reach)
        assert euler(boundary(cells)) == 2
        assert euler(boundary(opening.cells)) == 2 * parts
        assert len(np.unique(pieces(points[opening.parent], opening.cells))) == parts


@pytest.mark.parametrize(("quadratic", "law"), KINDS)
@pytest.mark.parametrize("reach", [WHOLE, HALF])
def test_mass_volume_and_springs_of_copies_add_up_to_what_was(quadratic, law, reach):
    points, cells, opening = cut_block(reach, quadratic=quadratic)
    before = body_of_cells(points, cells, law)
    after = body_of_cells(points[opening.parent], opening.cells, law)
    merged = np.bincount(opening.parent, weights=after.mass, minlength=len(points))
    np.testing.assert_allclose(merged, before.mass, rtol=1e-12)
    # A state of the body before has the same energy and volumes after, whatever it is.
    x = points + 0.002 * np.random.default_rng(5).standard_normal(points.shape)
    for measured in (lambda body, x: body.kept.measure(x).sum(), energy):
        assert measured(after, x[opening.parent]) == pytest.approx(measured(before, x), rel=1e-11, abs=0)


def energy(body, x: np.ndarray) -> float:
    ends, springs = body.springs.ends.astype(int), body.springs
    length = np.linalg.norm(x[ends[:, 0]] - x[ends[:, 1]], axis=1)
    return float(0.5 * springs.stiffness @ (length - springs.rest_length) ** 2) + body.measured(x).local_energy


def test_copies_lie_in_front_and_carry_what_the_mirror_carries():
    points, _, tetrahedra = block(CELLS, distortion=0.0)
    opening = opened(tetrahedra, layer_faces(tetrahedra), len(points))
    x = points[opening.parent]
    centre = x[opening.cells].mean(axis=1)
    for nodes, side in ((opening.pairs[:, 0], -1), (opening.pairs[:, 1], 1)):
        touching = np.isin(opening.cells, nodes).any(axis=1)
        assert (side * (centre[touching, 0] - 0.04) > 0).all()
    # A half is the mesh of that half alone.
    behind = tetrahedra[points[tetrahedra].mean(axis=1)[:, 0] < 0.04]
    assert np.array_equal(opening.cells[(opening.cells < len(points)).all(axis=1) & (centre[:, 0] < 0.04)], behind)
    body, half = body_of_cells(x, opening.cells), None
    used, numbered = np.unique(behind, return_inverse=True)
    half = body_of_cells(points[used], numbered.reshape(-1, 4))
    np.testing.assert_allclose(body.mass[used], half.mass, rtol=1e-13)


def test_nodes_between_corners_open_inside_the_cut_and_not_on_its_front():
    _, cells, opening = cut_block(HALF, quadratic=True)
    _, _, z = np.unravel_index(np.arange(np.prod(np.add(CELLS, 1))), np.add(CELLS, 1))
    corners = np.unique(cells[:, :4])
    front = [i for i in corners if z[i] == HALF]
    doubled = opening.pairs[:, 0]
    assert not np.isin(front, doubled).any()
    assert (doubled >= len(corners)).any() and (doubled < len(corners)).any()
    # As many as the linear mesh doubles, and one for each side of a face that is not on the front.
    linear = cut_block(HALF)[2]
    faces = layer_faces(cells[:, :4], CELLS, CELLS[0] // 2, HALF)
    sides = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    inner = ~np.isin(sides, front).all(axis=1)
    assert len(doubled) == len(linear.pairs) + inner.sum()


@pytest.mark.parametrize("seed", range(6))
def test_random_sheets_between_parts_open_into_closed_surfaces(seed, filled_ball):
    """Cells on either side of a random plane: their common faces, wherever the mesh has them."""
    random = np.random.default_rng(seed)
    normal = random.standard_normal(3)
    normal /= np.linalg.norm(normal)
    cells = filled_ball.tetrahedra.astype(np.int64)
    side = filled_ball.rest[cells].mean(axis=1) @ normal > random.uniform(-0.01, 0.01)
    faces, first, second = tetrahedron_faces(cells)
    between = (second >= 0) & (side[first // 4] != side[second // 4])
    # Each face as its cell behind the sheet sees it from outside.
    chosen = np.where(side[first[between] // 4, None], faces[between][:, ::-1], faces[between])
    opening = opened(cells, chosen, filled_ball.node_count)
    body = body_of_cells(filled_ball.rest[opening.parent], opening.cells)
    assert body.volume == pytest.approx(filled_ball.volume, rel=1e-13, abs=0)
    assert not np.isin(opening.cells[~side], opening.cells[side]).any()
    assert np.isin(opening.pairs[:, 0], opening.cells[~side]).all()


def test_a_face_that_is_not_between_two_cells_is_refused():
    points, triangles, tetrahedra = block(CELLS)
    with pytest.raises(MassSpringError, match="1 cut faces are not between two cells"):
        opened(tetrahedra, triangles[:1], len(points))
    with pytest.raises(MassSpringError, match="given twice"):
        opened(tetrahedra, layer_faces(tetrahedra)[[0, 0]], len(points))


def test_a_cut_of_one_inner_face_cannot_open():
    points, _, tetrahedra = block(CELLS)
    faces, _, second = tetrahedron_faces(tetrahedra)
    inside = ~np.isin(faces, boundary(tetrahedra)).any(axis=1) & (second >= 0)
    with pytest.raises(MassSpringError, match="1 cut faces and 0 sides between two"):
        opened(tetrahedra, faces[inside][:1], len(points))


NORMAL = np.array([0.2, -0.3, 1.0]) / np.linalg.norm([0.2, -0.3, 1.0])
OFF = 0.0031
"""Of the plane from the middle of the ball [m]."""
SHARED_KINDS = ("one", "van_gelder", "cotangent")


def plane(points: np.ndarray) -> np.ndarray:
    return (points - points.mean(axis=0)) @ NORMAL - OFF


def cut_by_plane(points: np.ndarray, cells: np.ndarray, reach: float = np.inf) -> VirtualNodes:
    """The cells cut by a plane up to x = `reach` [m]; cells on both sides of that by half of their section."""
    x = points[:, 0] - points[:, 0].mean() - reach
    behind = (x < 0)[cells]
    part = np.where(behind.all(axis=1), 1.0, np.where(behind.any(axis=1), 0.5, 0.0))
    return virtual_nodes(cells, plane(points), x < 0, part)


def body_of(kind: str, points: np.ndarray, triangles: np.ndarray, cells: np.ndarray, share=None) -> Body:
    law = "cotangent" if kind == "cotangent" else "van_gelder"
    body = tetrahedral_body(points, triangles, cells, SOFT, law, share)
    return body if kind == "one" else body.keeping(Volumes.nodal(body))


@pytest.fixture(scope="module", params=["whole", "half"])
def both(request, filled_ball):
    reach = np.inf if request.param == "whole" else 0.004
    rest, triangles, cells = filled_ball.rest, filled_ball.triangles, filled_ball.tetrahedra
    cut = cut_by_plane(rest, cells, reach)

    def bodies(kind: str) -> tuple[Body, Body]:
        return (
            body_of(kind, rest, triangles, cells),
            body_of(kind, rest[cut.parent], triangles, cut.cells, cut.share),
        )

    return cut, bodies


def pieces_of_copies(cut: VirtualNodes) -> np.ndarray:
    """Of each copy: copies are connected by their nodes."""
    n, cells = len(cut.parent), cut.cells.astype(int)
    ends = np.repeat(cells[:, 0], 4), cells.ravel()
    label = connected_components(csr_array((np.ones(cells.size), ends), shape=(n, n)), directed=False)[1]
    return np.unique(label[cells[:, 0]], return_inverse=True)[1]


def test_a_ball_cut_in_two_parts_into_pieces_of_exactly_what_lies_on_either_side(filled_ball):
    rest, cells = filled_ball.rest, filled_ball.tetrahedra
    cut = cut_by_plane(rest, cells)
    part = pieces_of_copies(cut)
    assert part.max() == 1
    volumes = cut.share * tetrahedron_volumes(rest[cut.parent], cut.cells)
    level, edges = plane(rest), np.sort(filled_ball.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    a, b = edges[(level[edges] > 0).sum(axis=1) == 1].astype(int).T
    crossing = rest[a] + (level[a] / (level[a] - level[b]))[:, None] * (rest[b] - rest[a])
    for piece in (0, 1):
        side = cut.side[(part == piece) & (cut.side != 0)]
        assert np.ptp(side) == 0
        # The surface is convex, and so is what lies on one side.
        truth = ConvexHull(np.concatenate([rest[np.sign(level) == side[0]], crossing])).volume
        assert volumes[part == piece].sum() == pytest.approx(truth, rel=1e-12)
    assert volumes.sum() == pytest.approx(filled_ball.volume, rel=1e-13, abs=0)


def test_the_share_of_a_cell_is_that_of_points_spread_evenly_in_it():
    rng = np.random.default_rng(3)
    levels = rng.normal(size=(40, 4))
    levels[np.ptp(np.sign(levels), axis=1) == 0, 0] *= -1
    places = rng.dirichlet(np.ones(4), 200_000)
    counted = (levels @ places.T > 0).mean(axis=1)
    np.testing.assert_allclose(part_in_front(levels), counted, atol=5e-3)
    np.testing.assert_allclose(part_in_front(levels) + part_in_front(-levels), 1.0, rtol=1e-15)
    sliver = np.array([[1e-6, -1.0, -2.0, -0.5], [1.0, 1.0, 1.0, -1e-6]])
    np.testing.assert_allclose(part_in_front(sliver), [1e-18, 1.0], rtol=1e-5)


@pytest.mark.parametrize("kind", SHARED_KINDS)
def test_mass_springs_and_volumes_of_the_copies_add_up_to_what_was(both, kind):
    cut, bodies = both
    before, after = bodies(kind)
    shares = np.bincount(cut.cell, weights=cut.share)
    np.testing.assert_allclose(shares, 1.0, rtol=1e-14)
    merged = np.bincount(cut.parent, weights=after.mass, minlength=before.node_count)
    np.testing.assert_allclose(merged, before.mass, rtol=1e-13)
    x = before.rest + 0.002 * np.random.default_rng(5).standard_normal(before.rest.shape)
    for measured in (energy, lambda body, x: body.kept.measure(x).sum()):
        assert measured(after, x[cut.parent]) == pytest.approx(measured(before, x), rel=1e-12, abs=0)
    assert after.volume == before.volume


@pytest.mark.parametrize("kind", SHARED_KINDS)
def test_no_sliver_shortens_the_step(both, kind):
    cut, bodies = both
    assert cut.share.min() < 1e-3
    before, after = (step_limit(body).damped for body in bodies(kind))
    assert 0.95 < after / before < 1 + 1e-6  # Rayleigh: copies may move together


@pytest.mark.parametrize("kind", SHARED_KINDS)
def test_volumes_of_the_kernel_and_their_slopes_are_the_sums_over_cells(both, kind):
    cut, bodies = both
    _, body = bodies(kind)
    rng = np.random.default_rng(11)
    x = body.rest + 0.001 * rng.standard_normal(body.rest.shape)
    state = ImplicitVolume().start(body)
    rows_into(x, state.model.inverse_mass, state.rows)
    each = cut.share * tetrahedron_volumes(x, cut.cells)
    truth = np.array([each.sum()]) if kind == "one" else np.bincount(cut.cells.ravel(), np.repeat(each / 4, 4))
    np.testing.assert_allclose(state.rows.volume, truth, rtol=1e-9)
    np.testing.assert_allclose(body.kept.measure(x), truth, rtol=1e-9)
    way, step = rng.standard_normal(x.shape), 1e-7
    slope = (body.kept.measure(x + step * way) - body.kept.measure(x - step * way)) / (2 * step)
    row = np.repeat(np.arange(body.kept.count), np.diff(state.rows.row_start.astype(int)))
    terms = np.einsum("ei,ei->e", state.rows.value[:, :3], way[state.rows.column])
    np.testing.assert_allclose(
        np.bincount(row, terms, body.kept.count), slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max()
    )


def test_stiffness_at_rest_is_the_slope_of_springs_and_pressures(both):
    _, bodies = both
    _, body = bodies("cotangent")
    way, step = np.random.default_rng(2).standard_normal(body.rest.shape), 1e-6

    def forces(x: np.ndarray) -> np.ndarray:
        ends, pull = body.springs.ends.astype(int), np.zeros_like(x)
        each = body.springs.stiffness[:, None] * (x[ends[:, 1]] - x[ends[:, 0]])
        np.add.at(pull, ends[:, 0], each)
        np.add.at(pull, ends[:, 1], -each)
        return pull.ravel() + body.kept.jacobian(x).T @ body.rest_lam

    assert np.abs(forces(body.rest)).max() < 1e-10 * body.rest_pressure * body.size**2
    slope = (forces(body.rest + step * way) - forces(body.rest - step * way)) / (2 * step)
    np.testing.assert_allclose(
        -stiffness_at_rest(body) @ way.ravel(), slope, rtol=1e-5, atol=1e-6 * np.abs(slope).max()
    )


def test_only_nodes_behind_the_front_are_parted(filled_ball):
    cut = cut_by_plane(filled_ball.rest, filled_ball.tetrahedra, 0.004)
    n = filled_ball.node_count
    x = filled_ball.rest[:, 0] - filled_ball.rest[:, 0].mean()
    assert len(cut.parent) > n and (x[cut.parent[n:]] < 0.004).all()
    assert np.array_equal(cut.parent[:n], np.arange(n))
    assert pieces_of_copies(cut).max() == 0
    # A joining copy stands on the nodes that were there, and each side on its own.
    joining = (cut.side == 0) & (cut.share < 1)
    assert joining.any() and (cut.cells[joining] < n).all()
    level = plane(filled_ball.rest)[cut.parent]
    for sign in (1, -1):
        own = cut.cells[cut.side == sign]
        assert (own[sign * level[own] > 0] < n).all()


def test_what_cannot_be_cut_is_refused(filled_ball):
    rest, cells = filled_ball.rest, filled_ball.tetrahedra
    everywhere, whole, level = np.ones(len(rest), bool), np.ones(len(cells)), plane(rest)
    with pytest.raises(MassSpringError, match="1 nodes lie on the sheet of a cut"):
        virtual_nodes(cells, np.where(np.arange(len(rest)) == 3, 0.0, level), everywhere, whole)
    with pytest.raises(MassSpringError, match="a cut parts no cell"):
        virtual_nodes(cells, level + 1.0, everywhere, whole)
    cut = virtual_nodes(cells, level, everywhere, whole)
    shared = body_of("cotangent", rest[cut.parent], filled_ball.triangles, cut.cells, cut.share)
    assert "a part alone is tissue" in (ExplicitElements().why_not(shared) or "")
    lloyd = [
        tetrahedral_body(rest, filled_ball.triangles, cells, SOFT, "lloyd"),
        tetrahedral_body(rest[cut.parent], filled_ball.triangles, cut.cells, SOFT, "lloyd", cut.share),
    ]
    limit = step_limit(lloyd[1])
    clock = make_clock(0.02, 2, 0.2 * limit.damped, limit)
    with pytest.raises(MassSpringError, match="springs of law 'lloyd' do not add up"):
        Setup(lloyd[0], ImplicitVolume(), clock, events=(Event(lloyd[1], cut.parent, np.zeros(1, int), 1),))
