"""Nonlinear finite elements with a volume penalty, backward Euler in time: Newton's method with a direct solver.

The energy per rest volume is that of `explicit_elements`, its volume part now at every point of every element
(docs/theory.md, eq. 13.1):

    W = mu/2 (|F|² − 3) − mu (J − 1) + b/2 (J − 1)² + K/2 (J − 1)²

with b = mu/3 on quadratic bodies, 0 on linear ones. A step solves

    M (1 + c dt) (x⁺ − x)/dt = M v + dt (f(x⁺) + m g) + Cᵀ γ/dt

by Newton's method with the exact derivative of f, factored in every pass; attached nodes are eliminated, obstacles
hold nodes as constraints C of each pass, with friction as in `implicit_springs`.

Limits: linear tetrahedra lock, the more so the larger K: the force on a ball of 251 nodes, held at both caps and
pressed, is 78 % too large with a ratio of 50 and 24 % with 10; with quadratic elements and 350 nodes 19 % with 50. Long
steps lose energy. Python runs once per pass. Obstacles touch only nodes, which on quadratic facets carry pressure
unevenly. A step whose passes do not converge, as can happen with friction, counts as one with a limited correction.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from massspring.body.body import Body
from massspring.body.points import PointVolumes
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.kernels.jit.stage_clock import BETWEEN_FRAMES, end_stage
from massspring.layout.allocate import CORRECTION_LIMIT, start
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.elements.laws import ELEMENT_LAWS, LawName, has_nodal_volumes, supported, why_not_corotated
from massspring.methods.elements.newton import Ending, NewtonStep, Prepared, missing
from massspring.methods.elements.tangent import Pattern, elements_of
from massspring.methods.families.pressure_law import check_modulus
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment


@dataclass(frozen=True)
class ImplicitElements(Method):
    """Nonlinear finite elements with a volume penalty, or corotated ones: backward Euler by Newton's method."""

    bulk_ratio: float = 50.0
    """K over the shear modulus [1]; 50 is a Poisson ratio of 0.49."""
    tolerance: float = 1e-6
    """Largest motion of a pass, over the mean length of a spring, at which the passes end [1]."""
    most_passes: int = 20
    """Most passes in a step; each takes a factorisation."""
    law: LawName = "neo_hookean"
    """"corotated": linear elasticity in frames that turn with the elements (docs/theory.md, eq. 13.11).
    The reported pressure is that of small strains, (K − mu/3) (1 − V/V0) of each nodal volume."""

    name: ClassVar[str] = "implicit_elements"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    conserves_angular_momentum: ClassVar[bool] = False
    capabilities: ClassVar[Capabilities] = Capabilities(
        "elements",
        "penalty",
        conditionally_stable=False,
        prestress=True,
        point_volumes=True,
        thin_probes=No("a contact there moves all nodes at once, which is solved for at nodes only"),
    )

    def __post_init__(self) -> None:
        check_modulus(self.name, "bulk_ratio", self.bulk_ratio, "mu")
        check_modulus(self.name, "tolerance", self.tolerance, "lengths of a spring")
        object.__setattr__(self, "capabilities", supported(self.capabilities, self.name, self.law))
        if self.most_passes < 1:
            raise MassSpringError(f"{self.name}'s most_passes is {self.most_passes}; it needs at least one")

    def why_not(self, body: Body) -> str | None:
        reason = self.capabilities.why_not(body)
        if reason is None and self.law == "corotated":
            reason = why_not_corotated(body)
        if reason is not None:
            return reason
        kept = body.kept
        if isinstance(kept, PointVolumes):
            return None if kept.closed is None else "its elements keep no volume of a lumen; take explicit_elements"
        return None if has_nodal_volumes(body) else "it keeps nodal volumes only; take explicit_elements"

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], with the pattern of its stiffness."""
        state = start(body, attachments, v)
        elements = elements_of(body, self.bulk_ratio * body.rest_pressure)
        return replace(
            state, memory=Prepared(body, elements, Pattern(elements, state.model), {}, ELEMENT_LAWS[self.law])
        )

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        after = begin_frame(state, boundary)
        end_stage(after.diagnostics.stage_times, BETWEEN_FRAMES)
        prepared: Prepared = after.memory
        ending = Ending(self.tolerance * after.model.correction_limit / CORRECTION_LIMIT, self.most_passes)
        for step in range(len(boundary.position)):
            NewtonStep(after, boundary, step).take(ending)
        filling = boundary.volume_target[-1] / prepared.body.rest_volumes
        local = 1.0 / 3.0 if self.law == "corotated" else 0.0
        bulk = (self.bulk_ratio - local) * prepared.body.rest_pressure
        return replace(after, lam=bulk * missing(prepared, after.nodes.x, filling))
