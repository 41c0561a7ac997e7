"""A constant matrix, factored once: A = (1 + c dt) M + dt² Σ_e k_e (e_i − e_j)(e_i − e_j)ᵀ, n × n (eq. 91).

Every spring takes its full stiffness in every direction, so the three components do not couple: three right-hand
sides. A is positive definite also where single weights of a cotangent network are negative.
"""

import numpy as np
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu

from massspring.kernels.layout import Motion, Network


class Factor:
    """A⁻¹ of one step length and damping; held nodes do not respond."""

    def __init__(self, network: Network, dt: float, damping: float) -> None:
        i, j = network.ends.astype(np.int64).T
        n = len(network.mass)
        rows, columns = np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])
        weights = np.concatenate([network.stiffness, network.stiffness, -network.stiffness, -network.stiffness])
        springs = coo_array((weights, (rows, columns)), shape=(n, n)).tocsr()
        matrix = diags_array((1.0 + damping * dt) * network.mass) + dt * dt * springs
        self.free = np.flatnonzero(network.inverse_mass > 0.0)
        self.nodes = n
        inner = matrix.tocsr()[self.free][:, self.free].tocsc()
        self.diagonal = np.where(network.inverse_mass > 0.0, matrix.diagonal(), np.inf)
        """Of A [kg], (n,); inf where held."""
        options = {"SymmetricMode": True}
        self._solve = splu(inner, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).solve
        self._columns: dict[int, np.ndarray] = {}

    def respond(self, forces: np.ndarray) -> np.ndarray:
        """A⁻¹ `forces`, (n, q)."""
        moved = np.zeros_like(forces)
        moved[self.free] = self._solve(np.ascontiguousarray(forces[self.free]))
        return moved

    def columns(self, nodes: np.ndarray) -> np.ndarray:
        """A⁻¹ e_i of each of `nodes` (c,), (n, c); a node's is solved for when it is first touched."""
        for node in nodes.tolist():
            if node not in self._columns:
                unit = np.zeros((self.nodes, 1))
                unit[node] = 1.0
                self._columns[node] = self.respond(unit)[:, 0]
        return np.column_stack([self._columns[node] for node in nodes.tolist()])


class Factors:
    """The factors of a run: one for each step length and damping it has seen."""

    def __init__(self) -> None:
        self._known: dict[tuple[float, float], Factor] = {}

    def at(self, network: Network, dt: float, damping: float) -> Factor:
        """The factor for steps of `dt` [s] with `damping` [1/s]."""
        if (dt, damping) not in self._known:
            self._known[dt, damping] = Factor(network, dt, damping)
        return self._known[dt, damping]


class Touching:
    """The directions that obstacles take in a step, as rows C of unit vectors at nodes, and their Schur complement."""

    def __init__(self, factor: Factor, motion: Motion, surface_nodes: np.ndarray, dt: float) -> None:
        locked = motion.locked[surface_nodes]
        slides, wedged, sticks = (surface_nodes[locked == kind].astype(np.int64) for kind in (1, 2, 3))
        axes = np.tile(np.eye(3), (len(sticks), 1))
        self.nodes = np.concatenate([slides, wedged, wedged, np.repeat(sticks, 3)])
        self.direction = np.concatenate(
            [motion.normal[slides], motion.normal[wedged], motion.second_normal[wedged], axes]
        )
        self.obstacle = motion.touched[self.nodes].astype(np.int64) - 1
        second = len(slides) + len(wedged) + np.arange(len(wedged))
        self.obstacle[second] = motion.second[wedged].astype(np.int64) - 1
        self.place = np.einsum("ci,ci->c", self.direction, motion.x[self.nodes] + dt * motion.goal[self.nodes])
        """Where each row ends the step, along its direction [m], (c,)."""
        if len(self.nodes):
            self._columns = factor.columns(self.nodes)
            schur = self._columns[self.nodes] * (self.direction @ self.direction.T)
            self._inverse = np.linalg.inv(schur)

    def along(self, field: np.ndarray) -> np.ndarray:
        """C u, (c,)."""
        return np.einsum("ci,ci->c", self.direction, field[self.nodes])

    def impulses(self, missing: np.ndarray) -> np.ndarray:
        """γ = (C A⁻¹ Cᵀ)⁻¹ `missing` [kg m], (c,): what moves the rows by `missing` [m] (eq. 93)."""
        return self._inverse @ missing

    def moved_by(self, impulses: np.ndarray) -> np.ndarray:
        """A⁻¹ Cᵀ γ [m], (n, 3)."""
        return self._columns @ (impulses[:, None] * self.direction)

    def without(self, field: np.ndarray) -> np.ndarray:
        """A response `field` (n, 3) with the part that obstacles take removed: the response of W̃."""
        if not len(self.nodes):
            return field
        return field + self.moved_by(self.impulses(-self.along(field)))
