"""Every organ as it is meshed at 550 nodes: size, attachments, symmetry, against numbers from outside the mesher."""

from dataclasses import replace

import numpy as np
import pytest

from studies.geometry import SHAPES, organ, vary
from studies.geometry.mesh.checks import check_one_part, check_surface
from studies.geometry.mesh.organ_mesh import triangle_areas, unique_edges
from studies.geometry.surface.first_surface import first_surface

ORGANS = tuple(name for name, make in SHAPES.items() if make().literature is not None)
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def meshes(mesh_cache):
    return {name: organ(name, 550) for name in ORGANS}


@pytest.mark.parametrize("name", ORGANS)
def test_volume_is_that_of_the_literature(meshes, name):
    mesh, shape = meshes[name], SHAPES[name]()
    assert mesh.hollow == (shape.wall is not None)
    volume = mesh.lumen_volume if mesh.hollow else mesh.volume
    assert 1e6 * volume == pytest.approx(shape.literature.volume_ml, rel=0.15)
    if mesh.hollow:
        # A wall of even thickness: its volume lies between lumen and outer surface times the thickness.
        inner = triangle_areas(mesh.points, mesh.lumen_triangles).sum() * shape.wall
        outer = triangle_areas(mesh.points, mesh.outer_triangles).sum() * shape.wall
        assert inner < mesh.volume < outer


@pytest.mark.parametrize("name", ORGANS)
def test_surface_and_lumen_are_closed_and_of_genus_0(meshes, name):
    mesh = meshes[name]
    assert mesh.outer_count == 550 and len(mesh.outer_triangles) == 1096
    for triangles in (mesh.outer_triangles, *([mesh.lumen_triangles] if mesh.hollow else [])):
        nodes, numbers = np.unique(triangles, return_inverse=True)
        own = numbers.reshape(-1, 3)
        check_surface(mesh.points[nodes], own)
        check_one_part(own, name)
        assert len(nodes) - len(unique_edges(own)) + len(own) == 2  # Euler: a ball's surface


@pytest.mark.parametrize("name", ORGANS)
def test_attachments_are_discs(meshes, name):
    mesh, shape = meshes[name], SHAPES[name]()
    assert set(mesh.patches) == set(shape.regions) != set()
    for patch in shape.regions:
        faces = mesh.patch_triangles(patch)
        assert len(np.unique(faces)) - len(unique_edges(faces)) + len(faces) == 1  # one piece without holes
        assert mesh.patches[patch].max() < mesh.outer_count


def check_areas(name, mesh, least):
    """Attached areas of a mesh over the true ones, which a surface of 3 mm cells gives, are from `least` to 1.02."""
    shape = SHAPES[name]()
    points, triangles = first_surface(replace(shape, cell=0.003))
    for patch, region in shape.regions.items():
        inside = (region.level(points) <= 0)[triangles].mean(axis=1)
        true = (inside * triangle_areas(points, triangles)).sum()
        assert least * true < triangle_areas(mesh.points, mesh.patch_triangles(patch)).sum() < 1.02 * true


# Inscribed facets 11 mm wide on a tip of 14 mm radius lose 2 h^2 / (8 R^2), 15.4 per cent; twice as many half.
@pytest.mark.parametrize(("name", "least"), [(name, 0.83 if name == "stomach" else 0.92) for name in ORGANS])
def test_attachments_have_their_true_size(meshes, name, least):
    check_areas(name, meshes[name], least)


@pytest.mark.campaign
@pytest.mark.parametrize("name", ORGANS)
def test_attachments_of_finer_meshes_are_nearer_to_their_true_size(mesh_cache, name):
    check_areas(name, organ(name, 1100, fill=False), 0.92)


@pytest.mark.parametrize(("name", "axis"), [("bladder", 0), ("kidney", 2)])
def test_symmetric_organs_weigh_as_much_on_either_side(meshes, name, axis):
    mesh = meshes[name]
    surface = mesh.outer()
    a, b, c = surface.points[surface.triangles].transpose(1, 0, 2)
    moment = (np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0) @ ((a + b + c) / 4.0)
    # The mesh itself is not symmetric: facets lie up to h^2 / 8R under the surface, an eighth of a millimetre here.
    assert abs(moment[axis] / surface.volume) < 2e-4


def test_a_variation_that_gmsh_cannot_mesh_evenly_is_meshed_all_the_same(mesh_cache):
    """Of this liver gmsh makes no well-shaped surface of 200 nodes in any try."""
    mesh = organ("liver", 200, parameters=dict(vary("liver", 1)))
    assert mesh.outer_count == 200
    check_surface(mesh.points[:200], mesh.outer_triangles)
