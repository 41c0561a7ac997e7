"""Whether an element folds is judged where the reference integrates: the mesher's bound refuses more than that."""

from dataclasses import replace

import numpy as np
import pytest
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from reference_fem import SolveError, nodes
from reference_fem.elements.shapes import build_elements, check_neighbours, element_nodes
from studies.base.errors import StudyError
from studies.geometry import curved
from studies.population import member
from studies.reference.mesh import reference_mesh
from studies.scene.meshing import mesh_for

STRICT = member("kidney", 0, 6)
"""The mesher's bound refuses one element of its mesh of 370 surface nodes."""


def test_a_mesh_that_only_the_mesher_s_bound_refuses_is_taken():
    with pytest.raises(StudyError, match="fold when they follow"):
        curved(mesh_for(STRICT, 370))
    mesh, held, _ = reference_mesh(STRICT, 370)
    build_elements(mesh, 5)
    check_neighbours(mesh)
    assert len(held[0])


def test_parts_of_a_halved_curved_element_are_upright_though_their_corners_are_not():
    """Their maps are parts of one upright map: every Jacobian is positive where the reference integrates."""
    mesh, _, _ = reference_mesh(member("stomach", 0, 1), 430)
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
