"""Dead loads: forces per rest area or rest volume, which do not change as the body deforms."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from skfem import ElementTetP2, MeshTet
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from reference_fem.elements.shapes import (
    basis_table,
    build_elements,
    build_facets,
    element_nodes,
    nodes,
)
from reference_fem.errors import SolveError


@dataclass(frozen=True, eq=False)
class Traction:
    """Force per rest area on part of the boundary; it does not turn with the body.

    where: (3, N) rest positions of facet centres -> bool (N,). value: t [s], (3, M) rest positions -> (3, M) [Pa].
    """

    where: Callable
    value: Callable


@dataclass(frozen=True, eq=False)
class BodyForce:
    """Force per rest volume. value: t [s], (3, M) rest positions -> (3, M) [N/m³]."""

    value: Callable


@dataclass(frozen=True)
class PointMass:
    """A point mass at a node of the P2 mesh, with weight and, in a motion, inertia."""

    node: int
    """Row of `reference_fem.nodes(mesh)`."""
    mass: float
    """[kg]."""


class LoadedPoints(NamedTuple):
    """Quadrature points that a load acts at: k elements or facets, q points each."""

    value: Callable
    positions: np.ndarray
    """Rest positions, (3, k q) [m]."""
    weights: np.ndarray
    """Rest volumes [m³] or areas [m²], (k, q)."""
    functions: np.ndarray
    """Displacement functions at the points, (q, nu)."""
    table: np.ndarray
    """Their numbers, (k, nu)."""
    count: int
    """Number of all displacement functions."""


def find_points(load: Traction | BodyForce, mesh: MeshTet, order: int) -> LoadedPoints:
    """Where a load acts on one mesh; raises SolveError for a traction that finds no facet."""
    x = nodes(mesh)
    if isinstance(load, BodyForce):
        points, _ = get_quadrature(RefTet, order)
        functions, _ = basis_table(ElementTetP2(), points)
        table, weights = element_nodes(mesh), build_elements(mesh, order).weights
    else:
        facets = build_facets(mesh, order)
        chosen = np.asarray(load.where(x[facets.nodes[:, :3]].mean(axis=1).T), dtype=bool)
        if not chosen.any():
            raise SolveError("a traction acts on no facet of the boundary: choose a region that touches it")
        table, weights, functions = facets.nodes[chosen], facets.weights[chosen], facets.values
    where = np.einsum("qn,kni->kqi", functions, x[table]).reshape(-1, 3).T
    return LoadedPoints(load.value, where, weights, functions, table, len(x))


def nodal_force(points: LoadedPoints, t: float):
    """Force on every displacement unknown at time t, (3 count,) [N]; refuses values that are not finite."""
    value = np.asarray(points.value(t, points.positions), dtype=float)
    if value.shape != points.positions.shape or not np.isfinite(value).all():
        raise SolveError(
            f"a load gives values of shape {value.shape} at t = {t:g} s for {points.positions.shape[1]} points: "
            f"finite values of shape {points.positions.shape} are needed"
        )
    local = value.reshape(3, *points.weights.shape) * points.weights
    shares = np.einsum("ikq,qa->kai", local, points.functions).reshape(-1, 3)
    force = np.zeros((points.count, 3))
    np.add.at(force, points.table.ravel(), shares)
    return force.ravel()
