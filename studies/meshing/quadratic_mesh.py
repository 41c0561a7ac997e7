"""Quadratic tetrahedra of a scene's organ, and a measure of how far their elements are from folding."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from massspring.body.quadratic import CORNER_PARTS, MIDDLE_PARTS
from studies.geometry.mesh.organ_mesh import tetrahedron_volumes
from studies.geometry.mesh.quality import curved_volume, jacobian_coefficients

TURNED = [0, 2, 1, 5, 4, 3]
"""A six-node facet seen from its other side."""


@dataclass(frozen=True, eq=False)
class QuadraticMesh:
    """A mesh of quadratic tetrahedra, curved if the true shape is known."""

    name: str
    points: np.ndarray
    """Rest positions [m], (n, 3): nodes of the outer surface, then of the lumen, then inner ones."""
    cells: np.ndarray
    """Nodes of each element, (k, 10), in VTK's order of a quadratic tetrahedron; Jacobians are positive."""
    facets: np.ndarray
    """The whole boundary, outward from the tissue, (f, 6): corners, then the nodes between first and second, second and
    third, third and first."""
    lumen: np.ndarray
    """Facets of the lumen, turned so that they enclose it with positive volume, (l, 6)."""
    surface_count: int
    """Boundary nodes."""
    outer_count: int
    """Nodes of the outer surface."""
    patches: dict[str, np.ndarray]
    """All nodes of the facets of each held region."""
    recipe: dict[str, Any] = field(default_factory=dict)
    """The recipe of the mesh from which it was made, JSON-able."""
    cuts: dict[str, np.ndarray] = field(default_factory=dict)
    """Name -> corners of the faces inside the body along which a cut will open it, seen from in front of it, (f, 3)."""

    @property
    def hollow(self) -> bool:
        return len(self.lumen) > 0

    @property
    def volume(self) -> float:
        """Volume of the tissue inside the curved sides [m³]."""
        return curved_volume(self.points, self.cells)

    @property
    def smallest_jacobian(self) -> float:
        """Least Bernstein coefficient of an element's Jacobian over their mean, 1 when straight: a lower bound of the
        Jacobian over that of the mean. Positive: no element folds anywhere."""
        coefficients = jacobian_coefficients(self.points, self.cells)
        return float((coefficients.min(axis=1) / np.abs(coefficients.mean(axis=1))).min())


def uprightness(points: np.ndarray, cells: np.ndarray, straight_volume: np.ndarray) -> np.ndarray:
    """How far each element (k, 10) is from folding, (k,): 1 when straight, at most 0 when it folds or a part does.

    The smaller of two ratios to straight_volume (k,) [m³]: of the least Bernstein coefficient of the Jacobian, over 6,
    and of the least volume, times 8, of the eight flat tetrahedra that replace the element in contact, with its middle
    divided best.
    """
    bent = jacobian_coefficients(points, cells).min(axis=1) / 6.0
    corners = _volumes(points, cells[:, CORNER_PARTS]).min(axis=1)
    middles = np.max([_volumes(points, cells[:, parts]).min(axis=1) for parts in MIDDLE_PARTS], axis=0)
    return np.minimum(bent, 8.0 * np.minimum(corners, middles)) / straight_volume


def _volumes(points: np.ndarray, parts: np.ndarray) -> np.ndarray:
    return tetrahedron_volumes(points, parts.reshape(-1, 4)).reshape(parts.shape[:2])
