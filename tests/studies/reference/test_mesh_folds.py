"""Whether an element folds is judged where the reference integrates: the mesher's bound refuses more than that."""

import pytest

from reference_fem.elements.shapes import build_elements, check_neighbours
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
