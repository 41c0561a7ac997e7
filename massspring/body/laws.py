"""Stiffness laws: the stiffness of each spring from the mesh and the shear modulus (docs/theory.md, section 4).

*Matched* laws are scaled so that affine homogenisation gives the tissue's shear modulus, Σ k L² = 15 V mu (eq. 4.1);
*published* ones are used as their authors wrote them, with the Young's modulus of a network of central forces, E = 2.5
mu.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from massspring.body.springs import EDGES_OF_TETRAHEDRON, lengths, matched_scale, unique_edges
from massspring.kernels.forces.volume import tetrahedron_volumes_into

YOUNG = 2.5
"""E/mu of a network of central forces, whose Poisson ratio is ¼."""


@dataclass(frozen=True, eq=False)
class Edges:
    """The s edges of a tetrahedral mesh of k cells; each will be a spring."""

    points: np.ndarray
    """[m], (n, 3)."""
    tetrahedra: np.ndarray
    """Positive, (k, 4)."""
    share: np.ndarray | None = None
    """Part of each cell that is tissue, (k,); None: all of it."""

    @cached_property
    def volumes(self) -> np.ndarray:
        """Of the tissue in each cell [m³], (k,)."""
        volumes = np.empty(len(self.tetrahedra))
        tetrahedron_volumes_into(self.points, self.tetrahedra, volumes)
        return volumes if self.share is None else volumes * self.share

    @cached_property
    def ends(self) -> np.ndarray:
        """Each edge once, (s, 2)."""
        return unique_edges(self.tetrahedra, EDGES_OF_TETRAHEDRON)

    @cached_property
    def length(self) -> np.ndarray:
        """[m], (s,)."""
        return lengths(self.points, self.ends)

    @cached_property
    def _place(self) -> np.ndarray:
        """Which edge each local edge is, (6 k,)."""
        local = np.sort(self.tetrahedra[:, EDGES_OF_TETRAHEDRON], axis=2).reshape(-1, 2).astype(np.int64)
        size = len(self.points)
        return np.searchsorted(self.ends[:, 0].astype(np.int64) * size + self.ends[:, 1], local @ [size, 1])

    def summed(self, local: np.ndarray) -> np.ndarray:
        """Σ over the tetrahedra around each edge of values (k, 6) at their `EDGES_OF_TETRAHEDRON`, (s,)."""
        values = np.broadcast_to(local, (len(self.tetrahedra), len(EDGES_OF_TETRAHEDRON)))
        return np.bincount(self._place, weights=values.ravel(), minlength=len(self.ends))

    def gradients(self) -> np.ndarray:
        """∇φ_a [1/m] of the linear shape functions, (k, 4, 3)."""
        corners = self.points[self.tetrahedra]
        inverse = np.linalg.inv(corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
        return np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)

    def matched(self, weight: np.ndarray, mu: float) -> np.ndarray:
        """Relative stiffnesses `weight` (s,) scaled to Σ k L² = 15 V mu [N/m], (s,) (eq. 4.1)."""
        return weight * matched_scale(mu, float(self.volumes.sum()), weight, self.length)


def uniform(edges: Edges, mu: float) -> np.ndarray:
    """One k for all springs [N/m], (s,); matched."""
    return edges.matched(np.ones(len(edges.ends)), mu)


def van_gelder(edges: Edges, mu: float) -> np.ndarray:
    """k_e = E Σ_t∋e V_t/L_e² [N/m], (s,) (Van Gelder 1998; eq. 4.2): matched on any mesh, as it was published."""
    return edges.matched(edges.summed(edges.volumes[:, None]) / edges.length**2, mu)


def lloyd(edges: Edges, mu: float) -> np.ndarray:
    """k_e = Σ_t∋e (2√2/25) E L_e [N/m], (s,) (Lloyd, Székely, Harders 2007; eq. 4.3), as published.

    A regular tetrahedron gets 0.96 times the shear modulus, tetrahedra of a mesh generator about 1.2 times it.
    """
    return 2.0 * np.sqrt(2.0) / 25.0 * YOUNG * mu * edges.summed(np.ones((1, 1))) * edges.length


def lloyd_matched(edges: Edges, mu: float) -> np.ndarray:
    """Lloyd's k_e ∝ Σ_t∋e L_e [N/m], (s,), scaled to the shear modulus."""
    return edges.matched(lloyd(edges, mu), mu)


def cotangent(edges: Edges, mu: float) -> np.ndarray:
    """k_ij = −mu Σ_t V_t ∇φ_i·∇φ_j [N/m], (s,), of springs without length (eq. 4.4); negative at obtuse angles.

    ½ Σ k |x_i − x_j|² is then ∫ ½ mu |F|² of linear tetrahedra: with one volume per node an incompressible
    neo-Hookean solid. The springs pull with the stress mu I at rest, and a pressure of mu balances them.
    """
    gradient = edges.gradients()
    first, second = EDGES_OF_TETRAHEDRON.T
    product = np.einsum("kea,kea->ke", gradient[:, first], gradient[:, second])
    return edges.summed(-mu * edges.volumes[:, None] * product)


@dataclass(frozen=True)
class StiffnessLaw:
    """A law of the springs on the edges of a tetrahedral mesh."""

    stiffness: Callable[[Edges, float], np.ndarray]
    """Edges and shear modulus mu [Pa] -> k [N/m], (s,)."""
    matched: bool = True
    """Claim: Σ k L² = 15 V mu."""
    rest_length: bool = True
    """Whether the springs have one. Without, they need a rest pressure of mu and one volume per node."""

    @property
    def name(self) -> str:
        """That of the function."""
        return self.stiffness.__name__


LAWS: tuple[StiffnessLaw, ...] = (
    StiffnessLaw(van_gelder),
    StiffnessLaw(uniform),
    StiffnessLaw(lloyd, matched=False),
    StiffnessLaw(lloyd_matched),
    StiffnessLaw(cotangent, matched=False, rest_length=False),
)


def laws_by_name() -> Mapping[str, StiffnessLaw]:
    """LAWS by their names."""
    return {law.name: law for law in LAWS}
