"""What every organ promises at every size, held against numbers from outside the mesher."""

from dataclasses import replace

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import (
    SHAPES,
    HalfSpace,
    attach,
    ball,
    ball_octant,
    check_surface,
    check_tetrahedra,
    curved,
    fill,
    liver,
    organ,
    vary,
)
from studies.geometry.mesh.checks import check_one_part
from studies.geometry.mesh.organ_mesh import (
    boundary_triangles,
    same_triangles,
    tetrahedron_volumes,
    triangle_areas,
    unique_edges,
)
from studies.geometry.mesh.quality import (
    MIN_DIHEDRAL,
    MIN_RATIO,
    MIN_WALL_RATIO,
    dihedral_angles,
    tetrahedron_radius_ratio,
)
from studies.geometry.organs.liver import LIVER
from studies.geometry.surface.first_surface import first_surface

RADIUS = 0.05
ORGANS = tuple(name for name, make in SHAPES.items() if make().literature is not None)


def check_sound(mesh):
    """Closed surfaces of genus 0, and tetrahedra of sufficient quality that end at them node by node."""
    check_tetrahedra(mesh.points, mesh.tetrahedra)
    assert same_triangles(boundary_triangles(mesh.tetrahedra), mesh.triangles)
    for triangles in filter(len, (mesh.outer_triangles, mesh.lumen_triangles)):
        used, corners = np.unique(triangles, return_inverse=True)
        check_surface(mesh.points[used], corners.reshape(-1, 3))
        check_one_part(corners.reshape(-1, 3), mesh.name)
        assert len(triangles) == 2 * len(used) - 4  # Euler: a ball's surface
    volume = tetrahedron_volumes(mesh.points, mesh.tetrahedra).sum()
    assert volume == pytest.approx(mesh.volume, rel=1e-12)  # two sums of some thousand rounded terms
    ratio = tetrahedron_radius_ratio(mesh.points, mesh.tetrahedra).min()
    assert ratio >= (MIN_WALL_RATIO if mesh.hollow else MIN_RATIO)  # a thin wall is flat by nature
    assert mesh.hollow or dihedral_angles(mesh.points, mesh.tetrahedra).min() >= MIN_DIHEDRAL


@pytest.mark.parametrize("nodes", [150, 300, 550])
@pytest.mark.parametrize("organ", ["ball", "liver"])
def test_solid_meshes_have_their_nodes_on_the_true_surface(bodies, organ, nodes):
    mesh = bodies[organ][nodes]
    check_sound(mesh)
    assert mesh.surface_count == nodes and mesh.triangles.max() == nodes - 1
    surface = mesh.points[:nodes]
    level = np.linalg.norm(surface, axis=1) - RADIUS if organ == "ball" else LIVER.level(surface)
    # The projection stops at 1e-13 of the box, 0.4 m across the liver's.
    assert np.abs(level).max() < 1e-13 and (MIN_DIHEDRAL, MIN_RATIO) == (8.0, 0.1)


def test_ball_loses_volume_as_one_over_the_node_count(balls):
    exact = 4 / 3 * np.pi * RADIUS**3
    loss = {nodes: (1 - mesh.volume / exact) * nodes for nodes, mesh in balls.items()}
    # Facets of edge h lie h^2 / 12 R to h^2 / 6 R below the sphere, and h^2 = 8 pi R^2 / (sqrt 3 N): 3.6 to 7.2.
    assert all(5.4 < value < 6.3 for value in loss.values()), loss


@pytest.mark.parametrize("name", ["spleen", "bladder"])
def test_random_organs_are_sound(name):
    mesh = organ(name, 300, parameters=vary(name, 3))
    check_sound(mesh)
    made = curved(mesh)
    assert mesh.hollow == (name == "bladder") and made.smallest_jacobian > 0
    # Facets lie inside a convex surface: a straight solid is the smaller one, by a few per cent.
    assert mesh.hollow or 0.95 < mesh.volume / made.volume < 1.0


@pytest.fixture(scope="module")
def meshes(mesh_cache):
    return {name: organ(name, 550) for name in ORGANS}


@pytest.mark.slow
@pytest.mark.parametrize("name", ORGANS)
def test_organs_of_550_nodes_have_their_size_and_attachments(meshes, name):
    mesh, shape = meshes[name], SHAPES[name]()
    check_sound(mesh)
    assert mesh.hollow == (shape.wall is not None) and mesh.outer_count == 550
    volume = mesh.lumen_volume if mesh.hollow else mesh.volume
    assert 1e6 * volume == pytest.approx(shape.literature.volume_ml, rel=0.15)
    if mesh.hollow:
        # A wall of even thickness: its volume lies between lumen and outer surface times the thickness.
        inner, outer = (triangle_areas(mesh.points, one).sum() for one in (mesh.lumen_triangles, mesh.outer_triangles))
        assert inner * shape.wall < mesh.volume < outer * shape.wall
    assert set(mesh.patches) == set(shape.regions) != set()
    points, triangles = first_surface(replace(shape, cell=0.003))
    # Inscribed facets 11 mm wide on a tip of 14 mm radius lose 2 h^2 / (8 R^2), 15.4 per cent.
    least = 0.83 if name == "stomach" else 0.92
    for patch, region in shape.regions.items():
        faces = mesh.patch_triangles(patch)
        assert len(np.unique(faces)) - len(unique_edges(faces)) + len(faces) == 1  # one piece without holes
        assert mesh.patches[patch].max() < mesh.outer_count
        inside = (region.level(points) <= 0)[triangles].mean(axis=1)
        true = (inside * triangle_areas(points, triangles)).sum()
        assert least * true < triangle_areas(mesh.points, faces).sum() < 1.02 * true


@pytest.mark.slow
def test_a_variation_that_gmsh_cannot_mesh_evenly_is_meshed_all_the_same(mesh_cache):
    """Of this liver gmsh makes no well-shaped surface of 200 nodes in any try."""
    mesh = organ("liver", 200, parameters=dict(vary("liver", 1)))
    assert mesh.outer_count == 200
    check_surface(mesh.points[:200], mesh.outer_triangles)


@pytest.mark.parametrize(
    ("name", "nodes", "triangles"),
    [("liver", 544, 1084), pytest.param("stomach", 550, 1096, marks=pytest.mark.campaign)],
)
def test_the_paper_s_meshes_have_its_counts(name, nodes, triangles):
    """Jung, Hong, Choi 2005: 544 nodes and 1,084 triangles for the liver, 550 and 1,096 for the stomach."""
    mesh = organ(name, nodes, fill=False)
    assert (mesh.outer_count, len(mesh.triangles)) == (nodes, triangles)
    check_surface(mesh.points, mesh.triangles)


@pytest.mark.parametrize("sizes", [(0.015, 0.006), (0.02, 0.02)])
def test_octant_is_an_eighth_of_a_ball_graded_to_its_pole(sizes):
    h, h_pole = sizes
    mesh = ball_octant(RADIUS, h, h_pole)
    check_tetrahedra(mesh.points, mesh.tetrahedra)
    assert mesh.points.min() == 0.0  # exactly on the planes, never a rounding error beyond
    for axis, name in enumerate(("x0", "y0", "z0")):
        assert len(mesh.patches[name]) > 5 and (mesh.points[mesh.patches[name], axis] == 0.0).all()
    on_sphere = np.linalg.norm(mesh.points[mesh.patches["sphere"]], axis=1)
    assert np.abs(on_sphere - RADIUS).max() < 1e-16
    in_patches = np.unique(np.concatenate(list(mesh.patches.values())))
    assert (in_patches == np.arange(mesh.surface_count)).all()
    assert mesh.volume == pytest.approx(np.pi / 6 * RADIUS**3, rel=0.5 * (h / RADIUS) ** 2)
    edges = mesh.points[unique_edges(mesh.triangles)]
    length = np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1)
    from_pole = np.linalg.norm(edges.mean(axis=1) - [0, 0, RADIUS], axis=1)
    # Mesh edges scatter by a third around the target size, which grows linearly away from the pole.
    assert np.median(length[from_pole < 2 * h_pole]) == pytest.approx(h_pole + (h - h_pole) * h_pole / RADIUS, rel=0.4)
    assert np.median(length[from_pole > 0.9 * RADIUS]) == pytest.approx(h, rel=0.4)


def test_fill_keeps_surface_and_patches():
    bare = ball(150, regions={"top": HalfSpace((0, 0, 0.035), (0, 0, -1))}, fill=False)
    assert not len(bare.tetrahedra) and len(bare.points) == 150
    body = fill(bare)
    assert (body.points[:150] == bare.points).all() and (body.triangles == bare.triangles).all()
    assert len(body.tetrahedra) > 300 and (body.patches["top"] == bare.patches["top"]).all()


@pytest.mark.campaign
def test_a_fine_surface_is_filled_with_elements_that_grow_inwards():
    mesh = ball(4000, RADIUS)
    check_sound(mesh)
    size = np.cbrt(tetrahedron_volumes(mesh.points, mesh.tetrahedra))
    depth = RADIUS - np.linalg.norm(mesh.points[mesh.tetrahedra].mean(axis=1), axis=1)
    # Edges of 2.4 mm at the surface and of an eighth of the diameter, 12 mm, in the middle.
    assert np.median(size[depth > 0.5 * RADIUS]) > 2.5 * np.median(size[depth < 0.05 * RADIUS])


REFUSED = {
    "ball: 10 surface nodes asked for, but the mesher offers 60 to 20000": lambda: ball(10),
    "give a whole number": lambda: ball(550.5),
    "ball of radius -0.05 m cannot be meshed": lambda: ball(radius=-0.05),
    "region 'far' holds no surface node": lambda: ball(150, regions={"far": HalfSpace((0, 0, 1), (0, 0, -1))}),
    "has no length": lambda: ball(150, regions={"bad": HalfSpace((0, 0, 0), (0, 0, 0))}),
    "'top' is not a region": lambda: attach(ball(150, fill=False), {"bad": "top"}),
    "h = 0.06 m is outside": lambda: ball_octant(0.05, 0.06, 0.01),
    "liver: 20 surface nodes": lambda: liver(20),
    "unknown organ 'bal'; did you mean 'ball'": lambda: organ("bal", 300),
    "unknown parameter of the ball 'wal'; did you mean 'wall'": lambda: organ("ball", 300, parameters={"wal": 0.01}),
    "ball: 2 layers asked for, but it is solid": lambda: organ("ball", 300, layers=2),
    "ball: only a filled mesh can be curved": lambda: curved(ball(150, fill=False)),
    "its true shape is not known": lambda: curved(replace(ball(150), recipe={"kind": "file"})),
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_bad_wishes_get_a_sentence(sentence):
    with pytest.raises(StudyError, match=sentence):
        REFUSED[sentence]()
