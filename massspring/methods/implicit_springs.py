"""Implicit springs by local/global steps with a matrix factored once: for stiff bodies and long steps.

Backward Euler, M (1 + c dt) v⁺ = M v + dt (f(x⁺) + Jᵀ lam + m g), V(x⁺) = V0, obstacles as constraints. Liu, Bargteil,
O'Brien, Kavan (2013): with springs at their full stiffness in every direction the matrix A of `factor` is constant and
its quadratic model bounds the energy of the springs from above, so that passes

    A δ = M dt v + dt² (f(p) + m g) − (1 + c dt) M (p − x) + dt² Jᵀ lam + Cᵀ γ,   p ← p + δ

descend for any step. Each volume, linearised at p, takes one back-solve per step, Y = A⁻¹ Jᵀ; contact is eliminated
with the columns of A⁻¹ at touched nodes, so that W̃ = A⁻¹ − A⁻¹ Cᵀ (C A⁻¹ Cᵀ)⁻¹ C A⁻¹ replaces the W̃ of HCJ05.

Limits: no step is unstable, but long ones lose energy, and few passes slow down rotation. Python runs once per pass.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from massspring.body.body import Body
from massspring.body.volumes import Volumes
from massspring.kernels.arrays.layout import Accuracy, BoundaryConditions
from massspring.kernels.jit.stage_clock import BETWEEN_FRAMES, end_stage
from massspring.layout.allocate import start
from massspring.layout.jacobian_pattern import volume_rows
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.implicit.factor import Factors
from massspring.methods.implicit.passes import Step
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment


@dataclass(frozen=True)
class ImplicitSprings(Method):
    """Backward Euler by local/global passes (Liu et al. 2013), volumes and contact inside (HCJ05's constraint)."""

    passes: int = 10
    """Local/global passes a step."""
    tolerance: float = 1e-6
    """Volume error that an iterative solve may leave, over the volume [1]."""
    most_iterations: int = 200

    name: ClassVar[str] = "implicit_springs"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 1e-6
    conserves_angular_momentum: ClassVar[bool] = False
    capabilities: ClassVar[Capabilities] = Capabilities(
        "several",
        "limited",
        conditionally_stable=False,
        triangle_springs=No("they harden without bound, and no constant matrix lies above them"),
        prestress=True,
        thin_probes=No("a contact there moves all nodes at once, which is solved for at nodes only"),
    )

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], and no matrix factored yet."""
        state = start(body, attachments, v)
        assert isinstance(body.kept, Volumes)  # others are refused
        rows = volume_rows(body.kept, body.node_count) if state.rows is None else state.rows
        return replace(state, rows=rows, memory=Factors())

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        after = begin_frame(state, boundary)
        assert after.rows is not None  # start() made them
        after.rows.lam[:] = after.lam + after.model.rest_lam
        factor = after.memory.at(after.model, boundary.dt, boundary.damping)
        end_stage(after.diagnostics.stage_times, BETWEEN_FRAMES)
        accuracy = Accuracy(self.tolerance, self.most_iterations)
        for step in range(len(boundary.position)):
            Step(after, boundary, step, factor, accuracy).take(self.passes)
        return replace(after, lam=after.rows.lam - after.model.rest_lam)
