"""Total-Lagrangian explicit dynamics (TLED): elements of a nearly incompressible neo-Hookean solid, no system to solve.

Miller, Joldes, Lance, Wittek (2007); linear tetrahedra with average nodal pressure by Bonet and Burton (1998) and
Joldes, Wittek, Miller (2009). The energy per rest volume

    W = mu/2 (|F|² − 3) − mu (J − 1) + K/2 (J − 1)²

has its first term in the springs without length of the body (docs/theory.md, eq. 4.4, 4.9), the other two in a pressure
that each kept volume knows from its size, p_r = mu + K (V0_r − V_r)/V0_r (eq. 13.2). One volume per node of a linear
body is the average nodal pressure.

Limits: as bulk modulus K − mu/3 on linear bodies, K on quadratic ones, is finite, what pressure p there is costs p/K of
a volume; a large K shortens the step as 1/√K.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.sparse import csr_array, diags_array

from massspring.body.body import Body
from massspring.kernels.arrays.layout import BoundaryConditions, Push
from massspring.kernels.constraint.jacobian import rows_into, transposed_rows_times_into
from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.stage_clock import VOLUME, end_stage
from massspring.kernels.points.arrays import PointRows
from massspring.kernels.points.elements import measure_into, push_into
from massspring.kernels.points.solve import weigh_into
from massspring.kernels.step.begin import begin_step, open_frame, search_contacts
from massspring.kernels.step.end import end_step
from massspring.layout.allocate import start
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.families.known_pressure import check_modulus
from massspring.methods.families.points import meet_points
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment

WRONG = 1e-6
"""Of a volume: what one without gradient may be off before a step is counted."""


@njit_inlined
def pressures_into(rows, mobility, rest_lam, bulk_modulus, target):
    """p_r = rest_lam_r + K (V0_r − V_r)/V0_r [Pa] (eq. 13.2); whether a wrong volume has nothing to push on."""
    idle = False
    for r in range(target.shape[0]):
        missing = (target[r] - rows.volume[r]) / target[r]
        rows.lam[r] = rest_lam[r] + bulk_modulus * missing
        idle |= not mobility[r] > 0.0 and abs(missing) > WRONG
    return idle


@njit_lean
def linear_elements_frame(frame, rows, bulk_modulus):
    """One frame of symplectic Euler with the pressures of the nodes as forces (eq. 3.1, 3.2, 3.5, 3.7, 13.2)."""
    model, nodes, boundary, diagnostics = frame.model, frame.nodes, frame.boundary, frame.diagnostics
    push = Push(rows.push, 1.0)
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        begin_step(frame, step, False)
        rows_into(nodes.x, model.inverse_mass, rows)
        target = boundary.volume_target[step]
        diagnostics.singular[0] += pressures_into(rows, rows.free_diagonal, model.rest_lam, bulk_modulus, target)
        transposed_rows_times_into(rows, rows.lam, rows.push)
        end_stage(diagnostics.stage_times, VOLUME)
        search_contacts(frame, step, push)
        # No contact changes a known pressure: no mobility.
        end_step(frame, step, push, 0.0, None)


@njit_lean
def quadratic_elements_frame(frame, rows, bulk_modulus):
    """The same with one volume per vertex of quadratic elements (eq. 8.8–8.12, 9.3–9.5)."""
    model, nodes, boundary, diagnostics = frame.model, frame.nodes, frame.boundary, frame.diagnostics
    push = Push(rows.push, 1.0)
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        begin_step(frame, step, False)
        weigh_into(model, nodes, rows, boundary)
        measure_into(rows, nodes.x, frame.work.padded_positions)
        target = boundary.volume_target[step]
        diagnostics.singular[0] += pressures_into(rows, rows.diagonal, model.rest_lam, bulk_modulus, target)
        push_into(rows, rows.lam)
        end_stage(diagnostics.stage_times, VOLUME)
        meet_points(frame, step, push, rows, None)
        end_step(frame, step, push, 0.0, None)


@dataclass(frozen=True)
class ExplicitElements(Method):
    """Explicit finite elements (TLED): neo-Hookean tetrahedra with average nodal pressure, linear or quadratic."""

    bulk_ratio: float = 50.0
    """K over the shear modulus [1]; 50 is a Poisson ratio of 0.49. Against the step of the same body with its volumes
    solved for, 10 takes 18 to 42 % off, 50 takes 60 to 73 %, 1000 takes 91 to 94 % (a ball and a liver, linear and
    quadratic)."""

    name: ClassVar[str] = "explicit_elements"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    capabilities: ClassVar[Capabilities] = Capabilities(
        "elements",
        "penalty",
        prestress=True,
        point_volumes=True,
        facet_contact=True,
        thin_probes=No("contact of its elements with them is untested"),
    )

    def __post_init__(self) -> None:
        check_modulus(self.name, "bulk_ratio", self.bulk_ratio, "mu")

    def added_stiffness(self, body: Body) -> csr_array:
        """Jᵀ diag(K/V0) J, with J at rest (eq. 13.3)."""
        weight = np.sqrt(self.bulk_ratio * body.rest_pressure / body.rest_volumes)
        return csr_array(body.kept.jacobian(body.rest).T @ diags_array(weight))

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s]; it remembers K [Pa]."""
        return start(body, attachments, v, memory=self.bulk_ratio * body.rest_pressure)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        """One frame."""
        after = begin_frame(state, boundary)
        assert after.rows is not None  # bodies with a single volume are refused
        frame = quadratic_elements_frame if isinstance(after.rows, PointRows) else linear_elements_frame
        frame(after.frame(boundary), after.rows, float(after.memory))
        return replace(after, lam=after.rows.lam - after.model.rest_lam)
