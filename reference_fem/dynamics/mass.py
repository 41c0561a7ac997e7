"""The consistent mass of the displacement, for frequencies and motion (docs/theory.md, eqs. 6.8 and 6.9)."""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from skfem import ElementTetP2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from reference_fem.elements.shapes import Elements, basis_table
from reference_fem.system.saddle_point import System


class Mass(NamedTuple):
    """The mass in two forms: as a matrix for forces, and in the pattern of the tangent."""

    matrix: sp.csr_matrix
    """One component, between the displacement functions (the P2 nodes), (N2, N2) [kg]."""
    values: np.ndarray
    """All components in the slots of the tangent's pattern, (pattern.size,) [kg]."""

    def times(self, field: np.ndarray):
        """Mass times a nodal field (N2, 3)."""
        return self.matrix @ field


def element_masses(elements: Elements, density: float, order: int):
    """rho integral N_a N_b of every element, (ne, nu, nu) [kg]; exact at order 4 on straight elements."""
    values, _ = basis_table(ElementTetP2(), get_quadrature(RefTet, order)[0])
    return density * np.einsum("eq,qa,qb->eab", elements.weights, values, values)


def build_mass(system: System) -> Mass:
    problem, elements = system.problem, system.elements
    local = element_masses(elements, problem.density, problem.order)
    count, width = len(system.nodes), len(elements.sizes.functions)
    table = elements.dofs[:, :width].astype(np.int64) // 3
    for hung in problem.masses:
        # Added to one element around the node, so that both forms contain it.
        element, place = np.argwhere(table == hung.node)[0]
        local[element, place, place] += hung.mass
    rows, cols = np.repeat(table, width, axis=1).ravel(), np.tile(table, (1, width)).ravel()
    matrix = sp.csr_matrix((local.ravel(), (rows, cols)), shape=(count, count))
    return Mass(matrix, packed(local, system.positions, system.pattern.size, elements.dofs.shape[1]))


def packed(local: np.ndarray, positions: np.ndarray, size: int, width: int):
    """Element masses (ne, nu, nu), once for each component, added into the slots of packed upper triangles."""
    values, count = np.zeros(size), local.shape[1]
    a, b = np.triu_indices(count)
    for component in range(3):
        row, col = count * component + a, count * component + b
        slots = positions[:, row * width - row * (row - 1) // 2 + col - row]
        values += np.bincount(slots.ravel(), local[:, a, b].ravel(), minlength=size)
    return values
