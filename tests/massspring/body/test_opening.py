"""Opening a mesh along faces: what must stay exact, what must grow, and what is refused."""

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

from massspring import MassSpringError, step_limit
from massspring.body.opening import opened
from massspring.body.partition import cell_graph, tetrahedron_faces
from massspring.body.volumes import tetrahedron_volumes
from tests.massspring.conftest import block, boundary
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


def test_the_volumes_of_both_pieces_add_up():
    points, cells, opening = cut_block(WHOLE)
    part = pieces(points[opening.parent], opening.cells)
    volumes = tetrahedron_volumes(points[opening.parent], opening.cells)
    assert np.ptp(part) == 1
    one, other = (volumes[part == k].sum() for k in (0, 1))
    whole = tetrahedron_volumes(points, cells.astype(np.uint32)).sum()
    assert one + other == pytest.approx(whole, rel=1e-13, abs=0)


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
    return float(0.5 * springs.stiffness @ (length - springs.rest_length) ** 2) + body.local_energy(x)


@pytest.mark.parametrize(("quadratic", "law"), KINDS)
def test_a_cut_never_lowers_the_highest_frequency(quadratic, law):
    points, cells, opening = cut_block(HALF, quadratic=quadratic)
    before = step_limit(body_of_cells(points, cells, law)).frequency
    after = step_limit(body_of_cells(points[opening.parent], opening.cells, law)).frequency
    # Motions in which copies move together are those of the body before (Rayleigh).
    assert after >= before * (1 - 1e-6)


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


@pytest.mark.parametrize("seed", range(20))
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
