"""Total-Lagrangian explicit dynamics (TLED): elements of a nearly incompressible neo-Hookean solid, no system to solve.

Miller, Joldes, Lance, Wittek (2007); linear tetrahedra with average nodal pressure by Bonet and Burton (1998) and
Joldes, Wittek, Miller (2009). The energy per rest volume

    W = mu/2 (|F|² − 3) − mu (J − 1) + K/2 (J − 1)²

has its first term in the springs without length of the body (docs/theory.md, eq. 4.4, 4.9). The other two give each
kept volume the explicit pressure p_r = mu + K (V0_r − V_r)/V0_r (eq. 13.2). One volume per node of a linear body is the
average nodal pressure.

Limits: the bulk modulus, K − mu/3 on linear bodies and K on quadratic ones, is finite, so a pressure p changes a volume
by p/K; a large K shortens the step as 1/√K.
"""

from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array

from massspring.body.body import Body
from massspring.kernels.arrays.layout import BoundaryConditions, Push
from massspring.kernels.constraint.jacobian import rows_into, transposed_rows_times_into
from massspring.kernels.forces.corotated import corotated_forces_into
from massspring.kernels.forces.elements import Elements
from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.stage_clock import VOLUME, end_stage
from massspring.kernels.points.arrays import PointRows
from massspring.kernels.points.elements import measure_into
from massspring.kernels.step.begin import begin_step, open_frame, search_contacts
from massspring.kernels.step.end import end_step
from massspring.layout.allocate import start
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.elements.laws import LawName, supported, why_not_corotated
from massspring.methods.elements.tangent import elements_of
from massspring.methods.families.points import begin_points, leave_points, meet_points
from massspring.methods.families.pressure_law import check_modulus
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment

WRONG = 1e-6
"""Relative error of a volume without gradient above which the step is counted as singular."""


@njit_inlined
def pressures_into(rows, mobility, rest_lam, bulk_modulus, target):
    """p_r = rest_lam_r + K (V0_r − V_r)/V0_r [Pa] (eq. 13.2). Returns whether a volume with an error has no
    gradient."""
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
        # Contact does not change an explicit pressure, so the mobility is 0.
        end_step(frame, step, push, 0.0, None)


@njit_lean
def quadratic_elements_frame(frame, rows, bulk_modulus):
    """The same with the volumes of quadratic elements (eq. 8.8–8.12, 9.3–9.5)."""
    model, nodes, boundary, diagnostics = frame.model, frame.nodes, frame.boundary, frame.diagnostics
    push = Push(nodes.gradient, 0.0)  # v* has the forces of all pressures
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        measure_into(rows, nodes.x, frame.work.padded_positions)
        target = boundary.volume_target[step]
        diagnostics.singular[0] += pressures_into(rows, rows.diagonal, model.rest_lam, bulk_modulus, target)
        begin_points(frame, step, rows)
        _, near = meet_points(frame, step, push, rows, None)
        leave_points(frame, step, rows, near)
        end_step(frame, step, push, 0.0, None)


@njit_inlined
def follow_targets(elements, rest_volumes, target):
    """Sets J* of each tetrahedron: the mean over its nodal volumes of target over rest volume."""
    for e in range(elements.node.shape[0]):
        ratio = 0.0
        for a in range(4):
            i = elements.node[e, a]
            ratio += 0.25 * target[i] / rest_volumes[i]
        elements.target_ratio[e, 0] = ratio


@njit_lean
def corotated_elements_frame(frame, elements, rest_volumes, force):
    """The same with corotated tetrahedra (eq. 13.12), their forces into `force` (n, 3)."""
    nodes, boundary, diagnostics = frame.nodes, frame.boundary, frame.diagnostics
    push = Push(force, 1.0)
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        begin_step(frame, step, False)
        follow_targets(elements, rest_volumes, boundary.volume_target[step])
        diagnostics.singular[0] += corotated_forces_into(elements, nodes.x, force)
        end_stage(diagnostics.stage_times, VOLUME)
        search_contacts(frame, step, push)
        end_step(frame, step, push, 0.0, None)


class Corotated(NamedTuple):
    """The memory of a state with corotated elements."""

    body: Body
    elements: Elements


@dataclass(frozen=True)
class ExplicitElements(Method):
    """Explicit finite elements (TLED): neo-Hookean tetrahedra with average nodal pressure, or corotated ones."""

    bulk_ratio: float = 50.0
    """K over the shear modulus [1]; 50 is a Poisson ratio of 0.49. Compared with the same body under implicit_volume,
    10 shortens the step by 18 to 42 %, 50 by 60 to 73 %, 1000 by 91 to 94 % (a ball and a liver, linear and
    quadratic)."""
    law: LawName = "neo_hookean"
    """"corotated": linear elasticity in frames that turn with the elements (docs/theory.md, eq. 13.11).
    Each element has a separate pressure, so they lock. The reported pressure is that of small strains, (K − mu/3) (1 −
    V/V0) of each nodal volume."""

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
        object.__setattr__(self, "capabilities", supported(self.capabilities, self.name, self.law))

    def why_not(self, body: Body) -> str | None:
        reason = self.capabilities.why_not(body)
        return why_not_corotated(body) if reason is None and self.law == "corotated" else reason

    def added_stiffness(self, body: Body) -> csr_array:
        """B with B Bᵀ = Jᵀ diag(K/V0) J, J at rest (eq. 13.3); for corotated elements with the volumes of
        tetrahedra."""
        if self.law == "corotated":
            elements = elements_of(body, self.bulk_ratio * body.rest_pressure)
            count = len(elements.node)
            root = np.sqrt(elements.constants[1] * elements.weight[:, 0])
            rows = (3 * elements.node[:, :, None] + np.arange(3)).ravel()
            values = (root[:, None, None] * elements.gradient[:, 0]).ravel()
            columns = np.repeat(np.arange(count), 12)
            return csr_array(coo_array((values, (rows, columns)), shape=(3 * body.node_count, count)))
        weight = np.sqrt(self.bulk_ratio * body.rest_pressure / body.rest_volumes)
        return csr_array(body.kept.jacobian(body.rest).T @ diags_array(weight))

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], with K [Pa] in its memory."""
        bulk = self.bulk_ratio * body.rest_pressure
        memory = Corotated(body, elements_of(body, bulk)) if self.law == "corotated" else bulk
        state = start(body, attachments, v, memory=memory)
        if isinstance(state.rows, PointRows):  # a compressible solid's law has a constant b
            state = replace(state, rows=state.rows._replace(rest_pressure=0.0))
        return state

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        after = begin_frame(state, boundary)
        assert after.rows is not None  # bodies with a single volume are refused
        if isinstance(after.memory, Corotated):
            return self._advance_corotated(after, after.memory, boundary)
        frame = quadratic_elements_frame if isinstance(after.rows, PointRows) else linear_elements_frame
        frame(after.frame(boundary), after.rows, float(after.memory))
        return replace(after, lam=after.rows.lam - after.model.rest_lam)

    def _advance_corotated(self, after: State, memory: Corotated, boundary: BoundaryConditions) -> State:
        """One frame of corotated elements."""
        body, rows = memory.body, after.rows
        assert rows is not None and not isinstance(rows, PointRows)  # other bodies are refused
        corotated_elements_frame(after.frame(boundary), memory.elements, body.rest_volumes, rows.push)
        filling = boundary.volume_target[-1] / body.rest_volumes
        missing = filling - body.kept.measure(after.nodes.x) / body.rest_volumes
        return replace(after, lam=(self.bulk_ratio - 1.0 / 3.0) * body.rest_pressure * missing)
