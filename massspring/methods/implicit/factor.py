"""A constant matrix, factored once: A = (1 + c dt) M + dt² Σ_e k_e (e_i − e_j)(e_i − e_j)ᵀ, n × n (eq. 12.1).

Every spring has its full stiffness in every direction, so the three components do not couple and are three right-hand
sides. A is positive definite even if single weights of a cotangent network are negative.
"""

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, diags_array, tril
from scipy.sparse.linalg import splu

from massspring.kernels.arrays.layout import Model
from massspring.kernels.arrays.volume_rows import VolumeRows
from massspring.kernels.constraint.ldl_solve import Triangular, respond_into


class Factor:
    """A⁻¹ of one step length and damping; held nodes do not respond."""

    def __init__(self, model: Model, dt: float, damping: float) -> None:
        n, matrix = len(model.mass), constant_matrix(model, dt, damping)
        free = np.flatnonzero(model.inverse_mass > 0.0)
        self.diagonal = np.where(model.inverse_mass > 0.0, matrix.diagonal(), np.inf)
        """Diagonal of A [kg], (n,); inf at held nodes."""
        self._triangular = triangular(matrix.tocsr()[free][:, free].tocsc(), free)
        self._place = np.full(n, -1)
        self._columns = np.empty((0, n))
        self._count = 0

    def respond(self, forces: np.ndarray) -> np.ndarray:
        """A⁻¹ `forces`, (n, 3) each."""
        moved = np.empty_like(forces)
        respond_into(self._triangular, forces, moved)
        return moved

    def alone(self, rows: VolumeRows) -> tuple[np.ndarray, np.ndarray]:
        """Σ_j |J_rj|²/A_jj [m⁴/kg] and max_j |J_rj|/A_jj [m²/kg], (m,): response of a volume to its pressure, and
        largest displacement of a node, with the diagonal of A only."""
        begin, square = rows.row_start[:-1].astype(np.int64), (rows.value**2).sum(axis=1)
        stiff = self.diagonal[rows.column]
        return np.add.reduceat(square / stiff, begin), np.maximum.reduceat(np.sqrt(square) / stiff, begin)

    def columns(self, nodes: np.ndarray) -> np.ndarray:
        """A⁻¹ e_i of each of `nodes` (c,), as rows, (c, n); that of a node is solved for when it is first touched."""
        new = np.unique(nodes[self._place[nodes] < 0])
        self._make_room(len(new))
        for three in (new[k : k + 3] for k in range(0, len(new), 3)):
            units = np.zeros((len(self._place), 3))
            units[three, np.arange(len(three))] = 1.0
            last = self._count + len(three)
            self._columns[self._count : last] = self.respond(units).T[: len(three)]
            self._place[three] = np.arange(self._count, last)
            self._count = last
        return self._columns[self._place[nodes]]

    def _make_room(self, count: int) -> None:
        """Doubles the storage of columns until `count` more fit."""
        while self._count + count > len(self._columns):
            more = np.empty((max(64, len(self._columns)), len(self._place)))
            self._columns = np.concatenate([self._columns, more])


def constant_matrix(model: Model, dt: float, damping: float) -> csr_array:
    """A = (1 + c dt) M + dt² K [kg] of all nodes, (n, n) (eq. 12.1)."""
    i, j = model.ends.astype(np.int64).T
    n = len(model.mass)
    rows, columns = np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])
    weights = np.concatenate([model.stiffness, model.stiffness, -model.stiffness, -model.stiffness])
    springs = coo_array((weights, (rows, columns)), shape=(n, n)).tocsr()
    return csr_array(diags_array((1.0 + damping * dt) * model.mass) + dt * dt * springs)


def triangular(matrix: csc_array, nodes: np.ndarray) -> Triangular:
    """L D Lᵀ of a positive definite matrix whose columns belong to `nodes`, ordered by least degree."""
    options = {"SymmetricMode": True}
    factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    assert np.array_equal(factor.perm_r, factor.perm_c)  # with a threshold of 0 rows are not exchanged
    below = csc_array(tril(factor.L, -1))
    below.sort_indices()
    return Triangular(
        start=below.indptr.astype(np.uint32),
        row=below.indices.astype(np.uint32),
        value=below.data,
        inverse_pivot=1.0 / factor.U.diagonal(),
        node=nodes[np.argsort(factor.perm_c)].astype(np.uint32),
        scratch=np.zeros((len(nodes), 4)),
    )


class Factors:
    """The factors of a run, one for each step length and damping in use."""

    def __init__(self) -> None:
        self._factors: dict[tuple[float, float], Factor] = {}

    def at(self, model: Model, dt: float, damping: float) -> Factor:
        """The factor for steps of `dt` [s] with `damping` [1/s]."""
        if (dt, damping) not in self._factors:
            self._factors[dt, damping] = Factor(model, dt, damping)
        return self._factors[dt, damping]
