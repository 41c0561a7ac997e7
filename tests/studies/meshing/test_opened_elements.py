"""The reference on an opened mesh: plane strain along a slit does not depend on the slit."""

import numpy as np
import pytest
from skfem import MeshTet, MeshTet2

from reference_fem import NeoHookean, PrescribedDisplacement, Problem, equilibrium_path, nodes
from studies.base.errors import StudyError
from studies.meshing.opened_mesh import opened_elements
from tests.massspring.conftest import block
from tests.massspring.cuts import layer_faces

CELLS, HEIGHT, EDGE = (2, 3, 3), 2, 0.02
STRAIN = np.diag([1.0, 1.1, 1.0 / 1.1]) - np.eye(3)
MATERIAL = NeoHookean(1800.0, 1e4 * 1800.0)


def opened_block() -> tuple[MeshTet2, np.ndarray]:
    """A block cut flat between its layers up to a front inside, and the parent of each node."""
    points, _, tetrahedra = block(CELLS, EDGE)
    at = np.unravel_index(np.arange(len(points)), np.add(CELLS, 1))[0]
    points[at == CELLS[0] // 2, 0] = EDGE * (CELLS[0] // 2)
    flat = MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(tetrahedra.T))
    return opened_elements(MeshTet2.from_mesh(flat), layer_faces(tetrahedra, CELLS, CELLS[0] // 2, HEIGHT))


def test_plane_strain_along_a_slit_keeps_it_shut():
    """But for what a finite bulk modulus leaves: the law's deviator pulls at the sides, mu/kappa of it is seen."""
    mesh, parent = opened_block()
    x = nodes(mesh)
    slit = np.bincount(parent)[parent] == 2
    inside = slit & (x[:, 1] > 0.005) & (x[:, 1] < 0.055) & (x[:, 2] > 0.005)
    assert inside.sum() >= 4
    places = {tuple(place) for place in np.round(x[inside], 9)}

    def outside(at: np.ndarray) -> np.ndarray:
        return np.array([tuple(place) not in places for place in np.round(at.T, 9)])

    held = PrescribedDisplacement(outside, motion=lambda t: (t, t, t), shape=lambda at: STRAIN @ at)
    (state,) = equilibrium_path(Problem(mesh, MATERIAL, (held,)), [1.0])
    np.testing.assert_allclose(state.u[inside], x[inside] @ STRAIN, atol=1e-4 * np.ptp(x))
    # What is held apart from its slit moves otherwise: the copies are free of each other.
    pulled = PrescribedDisplacement(
        lambda at: outside(at) & (np.abs(at[0] - EDGE) > 0.5 * EDGE),
        motion=lambda t: (t, t, t),
        shape=lambda at: np.stack([0.1 * at[0], 0 * at[1], 0 * at[2]]),
    )
    (state,) = equilibrium_path(Problem(mesh, MATERIAL, (pulled,)), [1.0])
    pairs = np.flatnonzero(slit)[np.argsort(parent[slit], kind="stable")].reshape(-1, 2)
    assert np.abs(np.diff(state.u[pairs, 0], axis=1)).max() > 0.02 * EDGE


def test_faces_that_are_not_between_elements_are_refused():
    points, triangles, tetrahedra = block(CELLS, EDGE)
    flat = MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(tetrahedra.T))
    with pytest.raises(StudyError, match="is not opened by the cut"):
        opened_elements(MeshTet2.from_mesh(flat), triangles[:1])
