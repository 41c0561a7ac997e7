"""The stiffness of elastic elements and springs in a pattern made once, factored again at every Newton pass."""

from typing import Any

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from massspring.body.body import Body
from massspring.body.laws import Edges
from massspring.body.points import BARYCENTRIC, PointVolumes
from massspring.kernels.arrays.layout import Model
from massspring.kernels.forces.elements import Elements, Places
from massspring.methods.implicit.factor import constant_matrix

OPTIONS: dict[str, Any] = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
"""SuperLU options for a factor without row exchanges."""


def elements_of(body: Body, bulk_modulus: float) -> Elements:
    """The elements of a body with one volume per node or over points, K = `bulk_modulus` [Pa]."""
    if isinstance(body.kept, PointVolumes):
        cells, gradient, weight = body.kept.cells, body.kept.gradient, body.kept.weight
    else:
        edges = Edges(body.rest, body.tetrahedra)
        cells, gradient, weight = body.tetrahedra, edges.gradients()[:, None], edges.volumes[:, None]
    a = cells.shape[1]
    return Elements(
        node=np.ascontiguousarray(cells, dtype=np.int64),
        gradient=np.ascontiguousarray(gradient),
        weight=np.ascontiguousarray(weight),
        constants=np.array([body.rest_pressure, bulk_modulus, body.local_bulk]),
        target_ratio=np.ones(weight.shape),
        area=np.zeros((a, 3)),
        block=np.zeros((a, a, 3, 3)),
    )


def target_ratios(body: Body, filling: np.ndarray) -> np.ndarray:
    """J* of the points of all elements [1], (k, q), from the targets `filling` (m,) of the kept volumes over their rest
    volumes."""
    if isinstance(body.kept, PointVolumes):
        return filling[body.kept.corner_volume] @ BARYCENTRIC.T
    return filling[body.tetrahedra].mean(axis=1, keepdims=True)


class Pattern:
    """The sparsity pattern of the stiffness of the free nodes, which are in minimum-degree order."""

    def __init__(self, elements: Elements, model: Model) -> None:
        n, cells = len(model.mass), elements.node
        rows, columns = np.repeat(cells, cells.shape[1], axis=1).ravel(), np.tile(cells, (1, cells.shape[1])).ravel()
        graph = csr_array(coo_array((np.ones(len(rows)), (rows, columns)), shape=(n, n)))
        free = np.flatnonzero(model.inverse_mass > 0.0)
        inner = csc_array(graph[free][:, free])
        degree = diags_array(np.asarray(inner.sum(axis=1)).ravel())
        ordered = splu(csc_array(inner + degree), **OPTIONS, permc_spec="MMD_AT_PLUS_A")
        self.free = free[np.argsort(ordered.perm_c)]
        """Numbers of the free nodes, in the order of their rows."""
        self.graph = csr_array(graph[self.free][:, self.free])
        self.graph.sort_indices()
        rank = np.full(n, -1)
        rank[self.free] = np.arange(len(self.free))
        self.rank = rank
        count = np.diff(self.graph.indptr).astype(np.int64)
        self._width = 3 * count
        start = 3 * self.graph.indices.astype(np.int64)
        rows_of_three = [np.tile((start[b:e, None] + np.arange(3)).ravel(), 3) for b, e in self._spans()]
        self.indices = np.concatenate([*rows_of_three, np.empty(0, dtype=np.int64)]).astype(np.int32)
        self.indptr = np.concatenate([[0], np.cumsum(np.repeat(3 * count, 3))]).astype(np.int32)
        width = np.zeros(n, dtype=np.int64)
        width[self.free] = self._width
        self.diagonal = self._entries(np.arange(len(self.free)), np.arange(len(self.free)))
        """Index in the data of the first entry of the diagonal block of each node, (f,)."""
        self.places = Places(self._entries(rank[rows], rank[columns]).reshape(*cells.shape, -1), width)

    def _spans(self) -> list[tuple[int, int]]:
        return list(zip(self.graph.indptr[:-1].tolist(), self.graph.indptr[1:].tolist(), strict=True))

    def _entries(self, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """Index in the data of the first entry of blocks (row, column), (b,) each; −1 if one of the two is −1."""
        size, indptr = len(self.free), self.graph.indptr.astype(np.int64)
        keys = np.repeat(np.arange(size), np.diff(indptr)) * size + self.graph.indices
        place = np.searchsorted(keys, row * size + column)
        inside = (row >= 0) & (column >= 0)
        row, place = np.where(inside, row, 0), np.where(inside, place, 0)
        return np.where(inside, 9 * indptr[row] + 3 * (place - indptr[row]), -1)

    def add_at_nodes(self, data: np.ndarray, nodes: np.ndarray, blocks: np.ndarray) -> None:
        """Adds `blocks` (c, 3, 3) [kg] of single free nodes (c,) to the data of a tangent."""
        row = self.rank[nodes]
        axis = np.arange(3)
        place = self.diagonal[row][:, None, None] + self._width[row][:, None, None] * axis[:, None] + axis
        data[place] += blocks

    def constant(self, model: Model, dt: float, damping: float) -> np.ndarray:
        """Data of (1 + c dt) M + dt² K of masses and springs without length [kg] (eq. 12.1)."""
        matrix = constant_matrix(model, dt, damping)[self.free][:, self.free].tocoo()
        first, row = self._entries(matrix.row, matrix.col), matrix.row
        data = np.zeros(len(self.indices))
        for axis in range(3):
            data[first + axis * (self._width[row] + 1)] = matrix.data
        return data


class Tangent:
    """T = (1 + c dt) M + dt² ∂²W/∂x² [kg] of the free nodes at given positions, factored.

    If entries are not finite, or a pivot is zero, solutions are NaN, and the run counts as diverged.
    """

    def __init__(self, pattern: Pattern, data: np.ndarray) -> None:
        self.pattern = pattern
        size = 3 * len(pattern.free)
        matrix = csc_array((data, pattern.indices, pattern.indptr), shape=(size, size))  # symmetric: rows are columns
        self._factor = _factored(matrix) if np.isfinite(data).all() else None
        self._answers: dict[tuple[int, bytes], np.ndarray] = {}

    def respond(self, forces: np.ndarray) -> np.ndarray:
        """T⁻¹ `forces`, (n, 3) each; 0 at held nodes."""
        moved = np.zeros_like(forces)
        moved[self.pattern.free] = self._solve(forces[self.pattern.free].ravel()).reshape(-1, 3)
        return moved

    def _solve(self, right: np.ndarray) -> np.ndarray:
        return np.full_like(right, np.nan) if self._factor is None else self._factor.solve(right)

    def columns(self, nodes: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """T⁻¹ of a unit force along each of `directions` (c, 3) at `nodes` (c,), (c, n, 3); each is solved for only
        once."""
        keys = [(int(node), direction.tobytes()) for node, direction in zip(nodes, directions, strict=True)]
        new = [k for k, key in enumerate(keys) if key not in self._answers]
        if new:
            right = np.zeros((3 * len(self.pattern.free), len(new)))
            first = 3 * self.pattern.rank[nodes[new]]
            for axis in range(3):
                right[first + axis, np.arange(len(new))] = directions[new, axis]
            for k, answer in zip(new, self._solve(right).T, strict=True):
                self._answers[keys[k]] = answer
        columns = np.zeros((len(keys), len(self.pattern.rank), 3))
        for c, key in enumerate(keys):
            columns[c, self.pattern.free] = self._answers[key].reshape(-1, 3)
        return columns


def _factored(matrix: csc_array) -> SuperLU | None:
    try:
        return splu(matrix, **OPTIONS, permc_spec="NATURAL")
    except RuntimeError:  # a pivot is exactly zero
        return None
