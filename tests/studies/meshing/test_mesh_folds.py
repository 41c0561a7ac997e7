"""Whether an element folds is judged where the reference integrates: the mesher's bound refuses more than that. Where
one would fold, sides bend less; all other meshes keep theirs."""

from dataclasses import replace

import numpy as np
import pytest
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from reference_fem import SolveError, facet_nodes, nodes
from reference_fem.elements.shapes import build_elements, check_neighbours, element_nodes
from studies.geometry import curved
from studies.geometry.mesh.quality import curved_volume
from studies.lab.population.draw import member
from studies.meshing.held_mesh import held_mesh
from studies.meshing.reference_mesh import on_true_sides, reference_mesh
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.shaping import upright_cells
from studies.meshing.true_shape import as_curved, on_true_shape, true_shape

STRICT = member("kidney", 0, 6)
"""The mesher's bound refuses one element of its mesh of 370 surface nodes."""
FOLDED = {16: 250, 12: 370, 19: 250, 39: 250}
"""Kidney of the population -> surface nodes of the mesh in which a side that follows the true shape turns a corner of
one element inside out."""
HALVED = {250: (1, 1), 370: (2, 2)}
"""Surface nodes -> times that elements are halved at outlines and at the contact."""


def curved_sides(scene, level):
    """The reference's mesh before elements at outlines are drawn, the same with sides that follow the true shape
    wherever that leads, and the elements of both (k, 10)."""
    organ_mesh = mesh_for(scene, level, on_shape=True)
    coarse = held_mesh(scene, organ_mesh)
    body = coarse.refined(scene, *HALVED[level])
    bent = on_true_shape(curved(organ_mesh, may_fold=True), coarse, true_shape(scene.organ), scene.held)
    return on_true_sides(scene, organ_mesh, coarse, body), as_curved(body, coarse, bent), upright_cells(body)


@pytest.mark.parametrize("number", [16, *(pytest.param(n, marks=pytest.mark.campaign) for n in (12, 19, 39))])
def test_a_side_that_turns_an_element_inside_out_bends_less(number):
    """The middle of one side stays .6 to 1.2 mm off the true shape; 98 of 100 nodes of the surface do not move."""
    scene, level = member("kidney", 0, number), FOLDED[number]
    mesh, bent, cells = curved_sides(scene, level)
    with pytest.raises(SolveError, match="inverted or flat at rest"):
        check_neighbours(bent)
    check_neighbours(mesh)
    moved = np.linalg.norm(nodes(mesh) - nodes(bent), axis=1)
    on_surface = moved[np.unique(facet_nodes(mesh))]
    assert 0.5e-3 < on_surface.max() < 1.3e-3
    assert (on_surface > 1e-9).mean() < 0.02
    volume, before = (curved_volume(nodes(one), cells) for one in (mesh, bent))
    assert abs(volume / before - 1.0) < 1e-5
    drawn, _, _ = reference_mesh(scene, level)
    build_elements(drawn, 5)
    check_neighbours(drawn)


def test_sides_that_fold_nothing_follow_the_true_shape_to_the_last_bit():
    """Not even the element that the mesher's bound refuses bends less."""
    mesh, bent, _ = curved_sides(STRICT, 370)
    np.testing.assert_array_equal(nodes(mesh), nodes(bent))


def test_parts_of_a_halved_curved_element_are_upright_though_their_corners_are_not():
    """Their maps are parts of one upright map: every Jacobian is positive where the reference integrates."""
    scene = member("stomach", 0, 1)
    organ_mesh = mesh_for(scene, 430, on_shape=True, even=True)
    coarse = held_mesh(scene, organ_mesh)
    mesh = on_true_sides(scene, organ_mesh, coarse, coarse.refined(scene, 1, 2))
    cells = element_nodes(mesh)
    det = mesh.mapping().detDF(get_quadrature(RefTet, 5)[0])  # by skfem's own map
    upright = np.sign(det.mean(axis=1))
    assert (det * upright[:, None] > 0).all()
    assert (np.linalg.det(_edges(nodes(mesh)[cells[:, :4]])) * upright <= 0).any()
    check_neighbours(mesh)
    turned = replace(mesh, t=mesh.t.copy(), doflocs=mesh.doflocs.copy())
    turned.doflocs[:, cells[7, 0]] += 0.1  # a vertex far outside turns what it belongs to inside out
    with pytest.raises(SolveError, match=r"overlap across their common face|inverted or flat"):
        build_elements(turned, 5)
        check_neighbours(turned)


def _edges(corners):
    """Edges of tetrahedra (k, 4, 3) from their first corners, (k, 3, 3)."""
    return corners[:, 1:] - corners[:, :1]
