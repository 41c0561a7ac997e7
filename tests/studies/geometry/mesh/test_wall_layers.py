"""Hollow organs: the wall between two matched surfaces, and what a mesh says of its two surfaces."""

from dataclasses import replace

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import HalfSpace, ball, check_surface, check_tetrahedra, organ
from studies.geometry.mesh.organ_mesh import boundary_triangles, signed_volume, tetrahedron_volumes
from studies.geometry.mesh.quality import MIN_WALL_RATIO, tetrahedron_radius_ratio
from studies.geometry.mesh.wall_layers import fill_wall, mend_wall, split_prisms, suggested_layers
from studies.geometry.organs import SHAPES
from studies.geometry.shape.levelset import at_depth, project

RADIUS, WALL = 0.05, 0.01
CAP = {"top": HalfSpace((0.0, 0.0, 0.035), (0.0, 0.0, -1.0))}


def hollow_ball(nodes=300, layers=None, regions=None):
    return organ("ball", nodes, regions, parameters={"radius": RADIUS, "wall": WALL}, layers=layers)


@pytest.fixture(scope="module")
def shells(mesh_cache):
    """Hollow balls by number of layers."""
    return {layers: hollow_ball(layers=layers, regions=CAP) for layers in (1, 2, 3)}


@pytest.mark.parametrize("layers", [1, 2, 3])
def test_wall_is_closed_oriented_and_conforming(shells, layers):
    mesh = shells[layers]
    check_tetrahedra(mesh.points, mesh.tetrahedra)
    # Not only the same nodes but the same turn: outward of the tissue, so into the lumen.
    turned = {tuple(np.roll(row, -row.argmin())) for row in boundary_triangles(mesh.tetrahedra)}
    assert turned == {tuple(np.roll(row, -row.argmin())) for row in mesh.triangles}
    assert len(mesh.points) == 300 * (layers + 1) and len(mesh.tetrahedra) == 3 * layers * 596
    assert tetrahedron_radius_ratio(mesh.points, mesh.tetrahedra).min() >= MIN_WALL_RATIO == 0.05
    total = tetrahedron_volumes(mesh.points, mesh.tetrahedra).sum()
    assert total == pytest.approx(mesh.volume, rel=1e-12)  # two sums of some thousand rounded terms


def test_the_two_surfaces_are_tagged_and_close_by_themselves(shells):
    mesh = shells[2]
    assert mesh.hollow and mesh.surface_count == 600 and mesh.outer_count == 300
    assert set(mesh.surfaces) == {"outer", "lumen"}
    assert np.sort(np.concatenate(list(mesh.surfaces.values()))).tolist() == list(range(len(mesh.triangles)))
    check_surface(mesh.points[:300], mesh.outer_triangles)  # outward: positive volume
    check_surface(mesh.points[300:600], mesh.lumen_triangles - 300)
    for triangles in (mesh.outer_triangles, mesh.lumen_triangles):
        assert len(triangles) == 2 * 300 - 4  # Euler: genus 0
    assert mesh.outer_volume - mesh.lumen_volume == pytest.approx(mesh.volume, rel=1e-12)
    solid = ball(150, RADIUS, fill=False)
    assert not solid.hollow and set(solid.surfaces) == {"outer"} and solid.lumen_volume == 0


def test_lumen_nodes_face_the_outer_ones_at_the_depth_of_the_wall(shells):
    for layers, mesh in shells.items():
        outer = mesh.points[:300]
        rings = {layers: mesh.points[300:600]}
        rings |= {k: mesh.points[300 * (k + 1) : 300 * (k + 2)] for k in range(1, layers)}
        for k, ring in rings.items():
            depth = k / layers * WALL
            assert np.abs(np.linalg.norm(ring, axis=1) - (RADIUS - depth)).max() < 1e-13
            # On a ball the facing point is on the radius; the normals of a mesh with 11 mm edges miss it a little.
            aside = np.linalg.norm(ring - outer * (1 - depth / RADIUS), axis=1)
            assert aside.max() < 0.15 * depth and np.median(aside) < 0.05 * depth


def test_the_outer_surface_alone(shells):
    alone = shells[2].outer()
    assert not alone.hollow and not len(alone.tetrahedra) and len(alone.points) == 300
    check_surface(alone.points, alone.triangles)
    assert len(alone.patches["top"]) > 5 and (alone.points[alone.patches["top"], 2] >= 0.035 - 1e-9).all()
    # The lumen reaches as high, z = 0.04, yet is not attached.
    assert shells[1].points[300:600, 2].max() > 0.037 and shells[1].patches["top"].max() < 300


def test_layers_follow_the_edges_unless_asked_for(shells):
    mesh = shells[1]
    surface = mesh.points[:300], mesh.outer_triangles
    # An edge of 300 equilateral triangles on this ball: sqrt(8 pi / (sqrt 3 N)) R = 11 mm.
    assert [suggested_layers(*surface, wall) for wall in (0.001, 0.011, 0.022, 0.033)] == [1, 1, 2, 3]
    assert len(hollow_ball(regions={}).tetrahedra) == 3 * 596


def test_prisms_are_cut_the_same_way_from_both_sides():
    # Two prisms over two triangles that share an edge, the columns numbered against the order of the triangles.
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    points = np.concatenate([square, square - [0, 0, 1]])
    for triangles in ([[0, 1, 2], [0, 2, 3]], [[2, 0, 1], [3, 0, 2]], [[1, 2, 0], [2, 3, 0]]):
        cells = split_prisms(np.array(triangles), np.array([0, 4]))
        volumes = tetrahedron_volumes(points, cells)
        assert volumes == pytest.approx(np.full(6, 1 / 6))
        assert len(boundary_triangles(cells)) == 12  # a cube cut into triangles: nothing left open inside
        assert signed_volume(points, boundary_triangles(cells)) == pytest.approx(1.0)


def test_a_spoiled_node_moves_back_on_its_level_and_the_others_stay(shells):
    mesh = shells[2]
    node = 450
    spoiled = mesh.points.copy()
    neighbours = np.unique(mesh.lumen_triangles[(mesh.lumen_triangles == node).any(axis=1)])
    spoiled[node] += 0.95 * (mesh.points[neighbours[neighbours != node][0]] - mesh.points[node])
    shape = SHAPES["ball"](RADIUS, WALL)
    spoiled[node] = project(at_depth(shape, WALL), spoiled[[node]])[0]
    assert tetrahedron_radius_ratio(spoiled, mesh.tetrahedra).min() < 0.1
    points = mend_wall(shape, spoiled, mesh.tetrahedra, 2)
    assert tetrahedron_radius_ratio(points, mesh.tetrahedra).min() >= 0.2
    assert np.linalg.norm(points[node]) == pytest.approx(RADIUS - WALL, rel=1e-12)
    moved = np.flatnonzero((points != spoiled).any(axis=1))
    assert node in moved and len(moved) < 10 and moved.min() >= 300


def test_bad_walls_get_a_sentence():
    surface, solid = ball(150, RADIUS, fill=False), SHAPES["ball"](RADIUS)
    for sentence, wall, layers in (
        ("ball is solid", None, 1),
        ("ball: 0 layers asked for its wall; choose 1 to 12", WALL, 0),
        ("a wall of 60 mm does not fit into it", 0.06, 1),
        (r"its wall of 49\.9 mm folds or flattens an element", 0.0499, 1),
    ):
        with pytest.raises(StudyError, match=sentence):
            fill_wall(replace(solid, wall=wall), surface.points, surface.triangles, layers)
