"""Random organs of every kind are sound: closed surfaces of genus 0, a fill that ends at them, good elements."""

import numpy as np
import pytest

from studies.geometry import OrganMesh, check_surface, check_tetrahedra, curved, organ, vary
from studies.geometry.mesh.organ_mesh import boundary_triangles, same_triangles, unique_edges
from studies.geometry.mesh.quality import (
    MIN_DIHEDRAL,
    MIN_RATIO,
    MIN_WALL_RATIO,
    dihedral_angles,
    tetrahedron_radius_ratio,
)


def check_topology(mesh: OrganMesh) -> None:
    check_tetrahedra(mesh.points, mesh.tetrahedra, mesh.name)
    for triangles in filter(len, (mesh.outer_triangles, mesh.lumen_triangles)):
        used, corners = np.unique(triangles, return_inverse=True)
        check_surface(mesh.points[used], corners.reshape(-1, 3))
        assert len(used) - len(unique_edges(triangles)) + len(triangles) == 2, "Euler's characteristic of a sphere"
    assert same_triangles(boundary_triangles(mesh.tetrahedra), mesh.triangles)


@pytest.mark.parametrize("name", ["spleen", "bladder"])
def test_random_organs_are_sound(name, mesh_cache):
    mesh = organ(name, 300, parameters=vary(name, 3))
    check_topology(mesh)
    assert mesh.hollow == (name == "bladder")
    ratio = tetrahedron_radius_ratio(mesh.points, mesh.tetrahedra).min()
    assert ratio >= (MIN_WALL_RATIO if mesh.hollow else MIN_RATIO)  # a thin wall is flat by nature
    if not mesh.hollow:
        assert dihedral_angles(mesh.points, mesh.tetrahedra).min() >= MIN_DIHEDRAL
        # Facets lie inside a convex surface: a straight solid is the smaller one, by a few per cent.
        assert 0.95 < mesh.volume / curved(mesh).volume < 1.0
    assert curved(mesh).smallest_jacobian > 0
