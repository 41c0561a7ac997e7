"""Forces of linear tetrahedra with the laws of programs that report no force of a held region (or none at all)."""

from abc import ABC, abstractmethod

import numpy as np


class Tetrahedra(ABC):
    """Tetrahedra (k, 4) with rest positions (n, 3) [m] and a law of their energy density.

    `m` and `k` are the constants of the law [Pa] that follow from the Lame constants mu and lam of small strains.
    """

    m: float
    k: float

    def __init__(self, rest: np.ndarray, cells: np.ndarray, mu: float, lam: float) -> None:
        edges = _edges(rest, cells)
        self.cells, self.inverse, self.volume = cells, np.linalg.inv(edges), np.linalg.det(edges) / 6.0
        self._set_constants(mu, lam)

    @abstractmethod
    def _set_constants(self, mu: float, lam: float) -> None: ...

    @abstractmethod
    def _density(self, trace: np.ndarray, j: np.ndarray) -> np.ndarray:
        """Energy density (k,) [J/m³] of tr F'F and det F."""

    @abstractmethod
    def _slopes(self, trace: np.ndarray, j: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Twice its derivative by tr F'F, and that by det F, (k,) each."""

    def energy(self, x: np.ndarray) -> float:
        """At x (n, 3) [m] [J]."""
        _, trace, j = self._strain(x)
        return float(self.volume @ self._density(trace, j))

    def forces(self, x: np.ndarray) -> np.ndarray:
        """On the nodes at x (n, 3) [m], (n, 3) [N]."""
        f, trace, j = self._strain(x)
        cofactor = j[:, None, None] * np.swapaxes(np.linalg.inv(f), 1, 2)
        shear, bulk = self._slopes(trace, j)
        stress = shear[:, None, None] * f + bulk[:, None, None] * cofactor
        on_three = -self.volume[:, None, None] * stress @ np.swapaxes(self.inverse, 1, 2)
        on_four = np.concatenate([-on_three.sum(axis=2, keepdims=True), on_three], axis=2)
        total = np.zeros_like(x)
        np.add.at(total, self.cells, np.swapaxes(on_four, 1, 2))
        return total

    def _strain(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """F (k, 3, 3), tr F'F (k,) and det F (k,)."""
        f = _edges(x, self.cells) @ self.inverse
        return f, np.einsum("kij,kij->k", f, f), np.linalg.det(f)


class StableNeoHookean(Tetrahedra):
    """Psi = m/2 (I - 3) - m/2 ln(I + 1) + k/2 (J - 1 - 3m/4k)², of Bullet and Drake.

    Smith, de Goes and Kim 2018, Section 3.4.
    """

    def _set_constants(self, mu: float, lam: float) -> None:
        self.m, self.k = 4.0 / 3.0 * mu, lam + 5.0 / 6.0 * mu

    def _density(self, trace: np.ndarray, j: np.ndarray) -> np.ndarray:
        bulk = 0.5 * self.k * (j - 1.0 - 0.75 * self.m / self.k) ** 2
        return 0.5 * self.m * (trace - 3.0 - np.log(trace + 1.0)) + bulk

    def _slopes(self, trace: np.ndarray, j: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.m * (1.0 - 1.0 / (trace + 1.0)), self.k * (j - 1.0) - 0.75 * self.m


class PlainStableNeoHookean(Tetrahedra):
    """Psi = m/2 (I - 3) + k/2 (J - 1 - m/k)², of Newton: the same without the logarithm."""

    def _set_constants(self, mu: float, lam: float) -> None:
        self.m, self.k = mu, lam + mu

    def _density(self, trace: np.ndarray, j: np.ndarray) -> np.ndarray:
        return 0.5 * self.m * (trace - 3.0) + 0.5 * self.k * (j - 1.0 - self.m / self.k) ** 2

    def _slopes(self, trace: np.ndarray, j: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.full_like(trace, self.m), self.k * (j - 1.0) - self.m


def _edges(x: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """From the first corner to the others, as columns (k, 3, 3)."""
    corners = x[cells]
    return np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
