"""Extended position-based dynamics on volumes: those of all tetrahedra, or the whole.

Macklin, Müller, Chentanez, XPBD: position-based simulation of compliant constrained dynamics, Motion in Games 2016.
From the predicted positions y the constraints are corrected one after the other; a sweep over all of them is an
iteration: Δp = (V0 − V(y) − C V0 p)/(dt² ∇V·W̃∇V + C V0), in the units of pressures, p = lam/dt² (docs/theory.md, eq.
10.14). p is accumulated over the iterations of a step: without the term C V0 p the constraint is hard for any
compliance C, a mistake in public implementations. The iterations converge to the compliant volume at the end of the
step.

Not in the publication: a sweep over tetrahedra ends with one more constraint, on the sum of their volumes, by an equal
pressure on all (eq. 10.15). The limit does not change, but without it corrections cell after cell need hundreds of
sweeps for an error common to all cells: five sweeps leave 2e-4 of the whole volume without it and 2e-8 with it (ball of
200 nodes).

Limits: the error of a finite number of iterations depends on their number and on dt. Gradients are taken at
intermediate positions, so angular momentum is not conserved. With a constraint per tetrahedron it locks as `element`
does.
"""

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np

from massspring.body.body import Body
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import BoundaryConditions, Push
from massspring.kernels.constraint.tetrahedra import relax_cells, relax_sum, relax_whole
from massspring.kernels.contact.node_contact import unpushed_into
from massspring.kernels.forces.tetrahedron_volumes import fill, mean_pressure
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.step.begin import begin_step, multiplier_stands, open_frame, search_contacts
from massspring.kernels.step.end import end_step
from massspring.layout.allocate import start
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.families.tetrahedra import cells_of, own_cells
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment


@njit_lean
def xpbd_frame(frame, cells, compliance, iterations, whole):
    """One frame (eq. 3.1–3.8, 10.14); returns the last pressure, with cells their mean [Pa]."""
    nodes, contacts, boundary, diagnostics = frame.nodes, frame.contacts, frame.boundary, frame.diagnostics
    lam, idle, push = 0.0, False, Push(cells.push, 1.0)
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        fill(cells, boundary, step)
        begin_step(frame, step, False)
        passes = search_contacts(frame, step, push)
        for sweep in range(passes):
            unpushed_into(nodes, contacts, boundary.dt, cells.y)
            cells.push[:] = 0.0
            cells.pressure[:] = 0.0
            lam, idle = mend(frame, cells, boundary.volume_target[step, 0], compliance, iterations, whole)
            if multiplier_stands(frame, step, push, np.inf, sweep + 1 == passes):
                break
        diagnostics.singular[0] += idle
        diagnostics.iterations[0] += iterations
        diagnostics.iterations[1] = iterations
        end_step(frame, step, push, 0.0, None)
    return lam if whole else mean_pressure(cells)


@njit_lean
def mend(frame, cells, target, compliance, iterations, whole):
    """Makes `iterations` sweeps over the volumes (eq. 10.14, 10.15). Returns the pressure of the whole [Pa], and
    whether a volume with an error had no gradient in the last sweep."""
    model, contacts, scale = frame.model, frame.contacts, frame.boundary.dt * frame.boundary.dt
    lam, idle = 0.0, False
    for _ in range(iterations):
        if whole:
            lam, idle = relax_whole(model, contacts, cells, target, scale, compliance, lam)
        else:
            idle = relax_cells(contacts, model.inverse_mass, cells, scale, compliance)
            idle |= relax_sum(model, contacts, cells, target, scale, compliance)
    return lam, idle


@dataclass(frozen=True)
class Xpbd(Method):
    """Corrects volumes of the predicted shape one after the other, in a fixed number of sweeps."""

    volumes: Literal["element", "whole"] = "element"
    """Volumes that are kept: that of each tetrahedron, or the whole."""
    iterations: int = 5
    """Sweeps over the volumes in a step. With "element" five are not converged: the force on a pressed ball still grows
    with every further sweep. With "whole" two are enough."""
    compliance: float = 0.0
    """C = 1/K [1/Pa]; 0 is hard."""

    name: ClassVar[str] = "xpbd"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 1e-4
    conserves_angular_momentum: ClassVar[bool] = False
    capabilities: ClassVar[Capabilities] = Capabilities(
        "tetrahedra",
        "full",
        converged=No("its sweeps over volumes stop before they agree"),
        thin_probes=No("it does not correct the volumes again after a contact has changed them"),
    )

    def __post_init__(self) -> None:
        if self.volumes not in ("element", "whole"):
            raise MassSpringError(f"xpbd keeps the volumes of 'element' or 'whole', not of '{self.volumes}'")
        if self.iterations < 1:
            raise MassSpringError(f"xpbd's iterations are {self.iterations}; it needs at least one")
        if not 0.0 <= self.compliance < float("inf"):
            raise MassSpringError(f"xpbd's compliance is {self.compliance} 1/Pa; it must be 0 or positive, and finite")
        if self.volumes == "whole":
            object.__setattr__(self, "capabilities", replace(self.capabilities, keeps="whole", converged=True))

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], with its cells at rest."""
        return start(body, attachments, v, cells_of(body))

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        after, cells = begin_frame(state, boundary), own_cells(state)
        # The forces of the last step are used to find contacts; a copy leaves those of the old state unchanged.
        cells = cells._replace(push=cells.push.copy())
        whole = self.volumes == "whole"
        lam = xpbd_frame(after.frame(boundary), cells, self.compliance, self.iterations, whole)
        return replace(after, lam=np.array([lam]), memory=cells)
