"""Where a solution needs smaller elements: the recovered-stress indicator of Zienkiewicz and Zhu.

Int. J. Numer. Methods Eng. 33, 1331 (1992): the stress is fitted by a linear function over the elements around each
vertex; the difference between the stress and the fit, interpolated from the vertices, estimates its error.
"""

import numpy as np
from skfem import ElementTetP2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from reference_fem.elements.shapes import basis_table, element_nodes, nodes
from reference_fem.system import assembly
from reference_fem.system.saddle_point import System


def stress_indicator(system: System, x: np.ndarray) -> np.ndarray:
    """∫ |P − P*|² dV of each element [Pa² m³], (ne,): nominal stress P against its recovery P*.

    x: unknowns of an equilibrium (total,). Use it only to rank elements. It does not estimate the error of a force: its
    sum is 20 to 35 times that error (docs/theory.md, section 6).
    """
    mesh, weights = system.problem.mesh, system.elements.weights
    F, p = assembly.deformation(x[: system.field_count], system.elements)
    P = system.problem.material.stress(F, p).reshape(*weights.shape, 9)
    points, _ = get_quadrature(RefTet, system.problem.order)
    shapes, _ = basis_table(ElementTetP2(), points)
    y = np.einsum("qn,eni->eqi", shapes, nodes(mesh)[element_nodes(mesh)])
    corners = mesh.t[:4].T
    fitted = vertex_fit(y, weights, P, corners, nodes(mesh)[: mesh.nvertices])
    linear = np.vstack((1.0 - points.sum(axis=0), points))
    recovered = np.einsum("aq,eac->eqc", linear, fitted[corners])
    return np.einsum("eq,eqc->e", weights, (P - recovered) ** 2)


def vertex_fit(y: np.ndarray, weights: np.ndarray, values: np.ndarray, corners: np.ndarray, vertices: np.ndarray):
    """Value at each vertex (N1, c) of the linear function nearest to `values` (ne, nq, c) in the elements around it.

    y: places of the values (ne, nq, 3) [m]; weights (ne, nq) [m³]; corners (ne, 4). Least squares.
    """
    count, c = len(vertices), values.shape[2]
    matrix, right = np.zeros((count, 4, 4)), np.zeros((count, 4, c))
    volumes = np.bincount(corners.ravel(), np.repeat(weights.sum(axis=1), 4), count)
    size = np.cbrt(volumes)
    for a in range(4):
        chosen = corners[:, a]
        basis = np.ones((*weights.shape, 4))
        basis[..., 1:] = (y - vertices[chosen][:, None]) / size[chosen, None, None]
        scaled = weights[..., None] * basis
        np.add.at(matrix, chosen, np.einsum("eqi,eqj->eij", scaled, basis))
        np.add.at(right, chosen, np.einsum("eqi,eqc->eic", scaled, values))
    return np.linalg.solve(matrix, right)[:, 0]
