"""Keeps the volume of every tetrahedron, by a penalty or as a hard constraint.

Penalty: Teschner, Heidelberger, Müller, Gross, A versatile and robust model for geometrically complex deformable
solids, Computer Graphics International 2004; energy ½ K V_t0 ((V_t − V_t0)/V_t0)² (docs/theory.md, eq. 10.11). Hard:
one multiplier per tetrahedron, all solved for together at the end of the step with the compliance 1/K (eq. 10.13), the
constraint of HCJ05 with as many volumes as there are cells.

Limits: a mesh has about five tetrahedra for each node and three coordinates: with all volumes kept it is too stiff
(locking), the more so the larger K. Contact forces are too large by a factor, not by a few per cent. The penalty
shortens the step, the hard constraint does not.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.sparse import csr_array

from massspring.body.body import Body
from massspring.kernels.arrays.layout import Accuracy, BoundaryConditions, Push
from massspring.kernels.constraint.tetrahedra import any_idle, cell_forces_into, cell_rows_into, solve_cells
from massspring.kernels.forces.tetrahedron_volumes import fill, mean_pressure
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.stage_clock import VOLUME, end_stage
from massspring.kernels.step.begin import begin_step, count_iterations, multiplier_stands, open_frame, search_contacts
from massspring.kernels.step.end import end_step
from massspring.layout.allocate import start
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.families.pressure_law import check_modulus
from massspring.methods.families.tetrahedra import cell_stiffness, cells_of, own_cells, push_cells
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment


@njit_lean
def hard_frame(frame, cells, compliance, accuracy):
    """One frame, all cells and contact inside the solve (eq. 3.1–3.8, 10.13); the mean pressure [Pa]."""
    nodes, contacts, boundary, diagnostics = frame.nodes, frame.contacts, frame.boundary, frame.diagnostics
    push = Push(cells.push, 1.0)
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        fill(cells, boundary, step)
        begin_step(frame, step, False)
        cell_rows_into(nodes.x, cells, cells.right)
        cell_forces_into(cells, cells.pressure, cells.push)
        end_stage(diagnostics.stage_times, VOLUME)
        passes = search_contacts(frame, step, push)
        for sweep in range(passes):
            cell_rows_into(nodes.x, cells, cells.right)
            count = solve_cells(nodes, contacts, frame.model.inverse_mass, cells, boundary.dt, compliance, accuracy)
            count_iterations(diagnostics, count)
            cell_forces_into(cells, cells.pressure, cells.push)
            if multiplier_stands(frame, step, push, np.inf, sweep + 1 == passes):
                break
        diagnostics.singular[0] += any_idle(cells, compliance, accuracy.tolerance)
        end_step(frame, step, push, 0.0, None)
    return mean_pressure(cells)


@dataclass(frozen=True)
class Element(Method):
    """Keeps the volume of every tetrahedron, softly or hard."""

    bulk_modulus: float = 100_000.0
    """K [Pa]; the default of `Penalty`, so that the two can be compared. As a penalty it shortens the step of a ball of
    1,500 tetrahedra by 80 %; as a hard constraint it does not."""
    hard: bool = False
    """Whether volumes are a hard constraint, with pressures solved for at the end of the step."""
    tolerance: float = 1e-4
    """Volume error of a tetrahedron that the hard solve may leave, over its volume [1]."""
    most_iterations: int = 200

    name: ClassVar[str] = "element"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    capabilities: ClassVar[Capabilities] = Capabilities(
        "tetrahedra",
        "penalty",
        thin_probes=No("its solve does not include how a contact changes the volumes of the tetrahedra"),
    )

    def __post_init__(self) -> None:
        check_modulus(self.name, "bulk_modulus", self.bulk_modulus)

    def added_stiffness(self, body: Body) -> csr_array | None:
        """B [√(N/m)], (3n, k), with B Bᵀ = Σ_t K/V_t0 dV_t/dx dV_t/dxᵀ; None if `hard`."""
        if self.hard:
            return None
        cells = cells_of(body)
        cell_rows_into(body.rest, cells, cells.right)
        slopes = np.concatenate([-cells.slope.sum(axis=1, keepdims=True), cells.slope], axis=1)
        return cell_stiffness(body, slopes, self.bulk_modulus / cells.rest_volume)

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], with its cells at rest."""
        return start(body, attachments, v, cells_of(body))

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        if not self.hard:
            return push_cells(state, boundary, self.bulk_modulus, False)
        after, cells = begin_frame(state, boundary), own_cells(state)
        accuracy = Accuracy(self.tolerance, self.most_iterations)
        lam = hard_frame(after.frame(boundary), cells, 1.0 / self.bulk_modulus, accuracy)
        return replace(after, lam=np.array([lam]), memory=cells)
