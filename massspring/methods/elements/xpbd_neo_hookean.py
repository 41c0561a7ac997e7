"""Extended position-based dynamics of stable neo-Hookean tetrahedra.

Macklin and Müller, A constraint-based formulation of stable neo-Hookean materials, Motion, Interaction and Games 2021.
Two constraints per tetrahedron have the energy of (13.1) on linear bodies (docs/theory.md, eq. 13.14): C_D = |F| with
stiffness mu V and C_H = J − J* − mu/K with stiffness K V. A sweep corrects the predicted positions tetrahedron after
tetrahedron (eq. 13.15). Both constraints of a tetrahedron are solved together, so that a body at rest stays at rest
with any number of sweeps. The springs of the body give no force: the first constraint replaces them.

Sweeps × sub-steps set the accuracy: `iterations`, and the steps of a frame.

Limits: the error of a finite number of sweeps depends on their number and on the step, and makes the body softer.
Gradients are taken at intermediate positions, so angular momentum is not conserved, and long steps are not stable: a
thrown block keeps its energy at one limit of the explicit springs, has forty times as much at five (fourteen with fifty
sweeps) and is lost at twenty with either. Linear tetrahedra with one pressure each lock.
"""

from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np

from massspring.body.body import Body
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import BoundaryConditions, Push
from massspring.kernels.constraint.neo_hookean import relax_elements
from massspring.kernels.contact.node_contact import unpushed_into
from massspring.kernels.forces.elements import Elements
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.step.begin import begin_step, multiplier_stands, open_frame, search_contacts
from massspring.kernels.step.end import end_step
from massspring.layout.allocate import start
from massspring.layout.sell_chunks import slices_of
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.elements.explicit_elements import follow_targets
from massspring.methods.elements.laws import has_nodal_volumes
from massspring.methods.elements.tangent import elements_of
from massspring.methods.families.pressure_law import check_modulus
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment


class Constraints(NamedTuple):
    """The memory of a state."""

    body: Body
    elements: Elements
    multiplier: np.ndarray
    """Of C_D and C_H [J], (k, 2); scratch."""
    y: np.ndarray
    """Intermediate positions [m], (n, 3); scratch."""
    push: np.ndarray
    """Force of all constraints [N], (n, 3)."""


@njit_lean
def neo_hookean_frame(frame, elements, rest_volumes, multiplier, y, force, iterations):
    """One frame (eq. 3.1–3.8, 13.15)."""
    model, nodes, contacts, boundary, diagnostics = (
        frame.model,
        frame.nodes,
        frame.contacts,
        frame.boundary,
        frame.diagnostics,
    )
    push, scale = Push(force, 1.0), boundary.dt * boundary.dt
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        follow_targets(elements, rest_volumes, boundary.volume_target[step])
        begin_step(frame, step, False)
        passes, idle = search_contacts(frame, step, push), False
        for sweep in range(passes):
            unpushed_into(nodes, contacts, boundary.dt, y)
            force[:] = 0.0
            multiplier[:] = 0.0
            for _ in range(iterations):
                idle = relax_elements(contacts, model.inverse_mass, elements, y, scale, multiplier, force)
            if multiplier_stands(frame, step, push, np.inf, sweep + 1 == passes):
                break
        diagnostics.singular[0] += idle
        diagnostics.iterations[0] += iterations
        diagnostics.iterations[1] = iterations
        end_step(frame, step, push, 0.0, None)


@dataclass(frozen=True)
class XpbdNeoHookean(Method):
    """XPBD with stable neo-Hookean constraints (Macklin, Müller 2021) on linear tetrahedra, in a number of sweeps."""

    bulk_ratio: float = 50.0
    """K over the shear modulus [1]; 50 is a Poisson ratio of 0.49."""
    iterations: int = 5
    """Sweeps over the tetrahedra in a step."""

    name: ClassVar[str] = "xpbd_neo_hookean"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    conserves_angular_momentum: ClassVar[bool] = False
    capabilities: ClassVar[Capabilities] = Capabilities(
        "elements",
        "penalty",
        converged=No("its sweeps over tetrahedra stop before they agree"),
        prestress=True,
        point_volumes=No("its tetrahedra are linear"),
        thin_probes=No("it does not correct its constraints again after a contact has changed them"),
    )

    def __post_init__(self) -> None:
        check_modulus(self.name, "bulk_ratio", self.bulk_ratio, "mu")
        if self.iterations < 1:
            raise MassSpringError(f"{self.name}'s iterations are {self.iterations}; it needs at least one")

    def why_not(self, body: Body) -> str | None:
        reason = self.capabilities.why_not(body)
        if reason is None and not has_nodal_volumes(body):
            return "it keeps nodal volumes only; take explicit_elements"
        return reason

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], with springs that give no force."""
        elements = elements_of(body, self.bulk_ratio * body.rest_pressure)
        k, n = len(elements.node), body.node_count
        memory = Constraints(body, elements, np.zeros((k, 2)), np.zeros((n, 3)), np.zeros((n, 3)))
        state = start(body, attachments, v, memory=memory)
        loose, model = replace(body.springs, stiffness=np.zeros(body.springs.count)), state.model
        slices = slices_of(loose, model.triangles, model.inverse_mass, body.rest)
        return replace(state, model=model._replace(slices=slices))

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        after, memory = begin_frame(state, boundary), state.memory
        # The forces of the last step are used to find contacts; a copy leaves those of the old state unchanged.
        push, body = memory.push.copy(), memory.body
        frame, volumes = after.frame(boundary), body.rest_volumes
        neo_hookean_frame(frame, memory.elements, volumes, memory.multiplier, memory.y, push, self.iterations)
        missing = boundary.volume_target[-1] / volumes - body.kept.measure(after.nodes.x) / volumes
        lam = self.bulk_ratio * body.rest_pressure * missing
        return replace(after, lam=lam, memory=memory._replace(push=push))
