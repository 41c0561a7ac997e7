"""Every tetrahedron keeps the distances of its nodes to its barycentre.

Bourguignon and Cani, Controlling anisotropy in mass-spring systems, Eurographics Workshop on Animation and Simulation
2000: forces along r_j, from the barycentre to node j, in proportion to Σ|r_j| − Σ|r_j|_0 (docs/theory.md, eq. 10.12).

Two changes. The factor is 9 K V_t0/(Σ|r_j|_0)², so that a cell that grows evenly resists with the bulk modulus K
whatever its size. The mean of the four directions is subtracted, which makes the force the derivative of an energy; as
published, an irregular cell exerts a net force on itself.

Limits: a sum of distances is not a volume: a cell can be flattened at no cost while its edges grow. K shortens the
step.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.sparse import csr_array

from massspring.body.body import Body
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.allocate import start
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities
from massspring.methods.families.pressure_law import check_modulus
from massspring.methods.families.tetrahedra import cell_stiffness, cells_of, push_cells
from massspring.methods.method import Method
from massspring.world.obstacles import Attachment


@dataclass(frozen=True)
class Barycentre(Method):
    """Pushes the nodes of each tetrahedron from its barycentre when they have come closer."""

    bulk_modulus: float = 100_000.0
    """K [Pa]; the default of `Penalty`, so that the two can be compared. It shortens the step of a ball of 1,500
    tetrahedra by 75 %."""

    name: ClassVar[str] = "barycentre"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    capabilities: ClassVar[Capabilities] = Capabilities("tetrahedra")

    def __post_init__(self) -> None:
        check_modulus(self.name, "bulk_modulus", self.bulk_modulus)

    def added_stiffness(self, body: Body) -> csr_array:
        """B [√(N/m)], (3n, k), with stiffness 9 K V_t0/(Σ|r|_0)² for every cell."""
        corners = body.rest[body.tetrahedra]
        spokes = corners - corners.mean(axis=1, keepdims=True)
        length = np.linalg.norm(spokes, axis=2, keepdims=True)
        units = spokes / length
        weight = 9.0 * self.bulk_modulus * body.tetrahedron_volumes / length.sum(axis=(1, 2)) ** 2
        return cell_stiffness(body, units - units.mean(axis=1, keepdims=True), weight)

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], with its cells at rest."""
        return start(body, attachments, v, cells_of(body))

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        return push_cells(state, boundary, self.bulk_modulus, True)
