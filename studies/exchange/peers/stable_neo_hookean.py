"""Forces of linear tetrahedra whose energy is that of Smith, de Goes and Kim 2018 with its logarithm, as in Bullet."""

import numpy as np


class StableNeoHookean:
    """Psi = m/2 (I - 3) - m/2 ln(I + 1) + l/2 (J - 1 - 3m/4l)², of tetrahedra (k, 4) with rest positions (n, 3) [m].

    I = tr F'F, J = det F; m and l follow from the Lame constants mu and lam [Pa] of small strains (their Section 3.4).
    """

    def __init__(self, rest: np.ndarray, cells: np.ndarray, mu: float, lam: float) -> None:
        edges = _edges(rest, cells)
        self.cells, self.inverse, self.volume = cells, np.linalg.inv(edges), np.linalg.det(edges) / 6.0
        self.m, self.l = 4.0 / 3.0 * mu, lam + 5.0 / 6.0 * mu

    def energy(self, x: np.ndarray) -> float:
        """At x (n, 3) [m] [J]."""
        _, trace, j = self._strain(x)
        bulk = 0.5 * self.l * (j - 1.0 - 0.75 * self.m / self.l) ** 2
        return float(self.volume @ (0.5 * self.m * (trace - 3.0 - np.log(trace + 1.0)) + bulk))

    def forces(self, x: np.ndarray) -> np.ndarray:
        """On the nodes at x (n, 3) [m], (n, 3) [N]."""
        f, trace, j = self._strain(x)
        cofactor = j[:, None, None] * np.swapaxes(np.linalg.inv(f), 1, 2)
        shear, bulk = self.m * (1.0 - 1.0 / (trace + 1.0)), self.l * (j - 1.0) - 0.75 * self.m
        stress = shear[:, None, None] * f + bulk[:, None, None] * cofactor
        on_three = -self.volume[:, None, None] * stress @ np.swapaxes(self.inverse, 1, 2)
        on_four = np.concatenate([-on_three.sum(axis=2, keepdims=True), on_three], axis=2)
        total = np.zeros_like(x)
        np.add.at(total, self.cells, np.swapaxes(on_four, 1, 2))
        return total

    def _strain(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """F (k, 3, 3), I (k,) and J (k,)."""
        f = _edges(x, self.cells) @ self.inverse
        return f, np.einsum("kij,kij->k", f, f), np.linalg.det(f)


def _edges(x: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """From the first corner to the others, as columns (k, 3, 3)."""
    corners = x[cells]
    return np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
