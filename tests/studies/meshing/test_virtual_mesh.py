"""A ball's mesh without faces on the cut, cut by virtual nodes: what moves, and what is shown of it."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import BallRegion, HalfSpace, organ
from studies.geometry.mesh.organ_mesh import signed_volume, tetrahedron_volumes, triangle_areas
from studies.meshing.virtual_mesh import virtual_mesh
from studies.metrics.run import doubled
from studies.runs.cutting import pieces_of
from studies.scene.cut import Cut

PLANE = HalfSpace((0.0, 0.0, 0.004), (0.0, 0.1, 1.0))
HALF = HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def ball():
    return organ("ball", 200, parameters={"radius": 0.05})


def test_the_tissue_is_the_ball_with_two_faces_more(ball):
    cut = virtual_mesh(ball, Cut("section", PLANE, at=1.0))
    tissue = cut.tissue
    rest, cells = tissue.mesh.points, tissue.mesh.tetrahedra
    piece = pieces_of(rest, cells)
    volumes = tetrahedron_volumes(rest, cells)
    assert piece.max() == 1 and (volumes > 0).all()
    assert volumes.sum() == pytest.approx(ball.volume, rel=1e-13)
    assert signed_volume(rest, tissue.mesh.triangles) == pytest.approx(ball.volume, rel=1e-12)
    # The same pieces as those of the copies, by their shares.
    copies = cut.share * tetrahedron_volumes(cut.mesh.points, cut.mesh.tetrahedra)
    own = pieces_of(cut.mesh.points, cut.mesh.tetrahedra)
    assert sorted(np.bincount(own, copies)) == pytest.approx(sorted(np.bincount(piece, volumes)), rel=1e-12)
    inside = doubled(rest, tissue.mesh.triangles, 0.17)
    whole = triangle_areas(rest, tissue.mesh.triangles).sum()
    added = triangle_areas(rest, tissue.mesh.triangles[inside]).sum()
    assert whole - triangle_areas(ball.points, ball.triangles).sum() == pytest.approx(added, rel=1e-9)
    assert added == pytest.approx(2 * np.pi * (0.05**2 - 0.004**2 / 1.01), rel=0.06)


def test_places_move_with_the_copies_on_their_side(ball):
    cut = virtual_mesh(ball, Cut("section", PLANE, at=1.0))
    tissue, rest = cut.tissue, cut.mesh.points
    np.testing.assert_allclose(tissue.places(rest), tissue.mesh.points, atol=1e-15)
    behind, front = tissue.pairs.T
    np.testing.assert_allclose(tissue.mesh.points[front], tissue.mesh.points[behind], atol=1e-15)
    assert np.abs(PLANE.level(tissue.mesh.points[front])).max() < 1e-15
    # One piece goes away: the other stays where it is, and each place with its own.
    node = np.zeros(len(rest), int)
    node[cut.mesh.tetrahedra] = pieces_of(rest, cut.mesh.tetrahedra)[:, None]
    upper = node == node[np.argmax(rest[:, 2])]
    step = np.array([0.001, 0.002, 0.01])
    moved = tissue.places(np.stack([rest, rest + upper[:, None] * step]))
    np.testing.assert_allclose(moved[1, front] - moved[1, behind], np.broadcast_to(step, (len(front), 3)), atol=1e-15)
    volumes = [tetrahedron_volumes(x, tissue.mesh.tetrahedra) for x in moved]
    np.testing.assert_allclose(volumes[1], volumes[0], rtol=1e-6, atol=1e-20)


def test_a_cut_with_a_front_parts_the_tissue_behind_it_alone(ball):
    cut = virtual_mesh(ball, Cut("incision", PLANE, HALF, at=1.0))
    tissue = cut.tissue
    assert pieces_of(tissue.mesh.points, tissue.mesh.tetrahedra).max() == 0
    virtual = cut.parent[len(ball.points) :]
    assert len(virtual) and (ball.points[virtual, 0] < 0).all()
    # What is shown as parted reaches past the front by less than an edge.
    x = tissue.mesh.points[tissue.pairs[:, 0], 0]
    edge = np.linalg.norm(np.diff(ball.points[ball.triangles[:, :2]], axis=1), axis=2).mean()
    assert x.min() < -0.045 and x.max() < edge
    assert set(cut.mesh.patches) == set(ball.patches)
    assert signed_volume(tissue.mesh.points, tissue.mesh.triangles) == pytest.approx(ball.volume, rel=1e-12)


def test_a_node_on_the_plane_bends_the_sheet_a_little(ball):
    node = ball.points[int(np.argmin(np.linalg.norm(ball.points, axis=1)))]
    through = HalfSpace(tuple(node.tolist()), (0.0, 0.1, 1.0))
    cut = virtual_mesh(ball, Cut("section", through, at=1.0))
    off = np.abs(through.level(cut.tissue.mesh.points[cut.tissue.pairs[:, 0]]))
    assert 0 < off.max() < 2e-6
    assert cut.share.min() > 0


def test_a_blade_that_reaches_no_node_is_refused(ball):
    with pytest.raises(StudyError, match="cut 'prick' does not open it: a cut parts no cell; make it larger"):
        virtual_mesh(ball, Cut("prick", PLANE, BallRegion((0.0, 0.0, 0.004), 1e-6), at=1.0))
